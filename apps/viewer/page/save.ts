// What the page hands out. It writes nothing by itself and sends nothing anywhere.
import { mat3, mat4, quat } from "gl-matrix";
import type { View } from "./data";
import { inverse, rows_from_matrix } from "./geometry";
import type { Landmark } from "./landmarks";
import type { Store } from "./state";
import { from_camera_px } from "./stored";

// pose.json, as `raylign register --start` reads it.
export const pose_json = (pose: mat4): string => JSON.stringify({ raylign: 1, world_from_ct: rows_from_matrix(pose) }, null, 1) + "\n";

// An ITK transform, as the program writes it: it maps points of the world to the CT.
export function pose_tfm(pose: mat4): string {
  const rows = rows_from_matrix(inverse(pose)), numbers = [...[0, 1, 2].flatMap((r) => rows[r].slice(0, 3)), ...[0, 1, 2].map((r) => rows[r][3])];
  return `#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters: ${numbers.join(" ")}\nFixedParameters: 0 0 0\n`;
}

const TRAJECTORY = "object,frame,status,searched,recovered,x_mm,y_mm,z_mm,qw,qx,qy,qz,jump_mm,cost,expected_error_mm,time_s,reasons";

// trajectory.csv with a row for each object and frame that `takes` takes: one file for several poses.
export function trajectory_csv(store: Store, takes: (frame: number, object: number) => boolean): string {
  const rows = store.scene.frames.flatMap(({ number }, frame) => store.scene.objects.flatMap(({ name }, object) => {
    if (!takes(frame, object)) return [];
    const { pose } = store.state.slots[frame][object], [x, y, z, w] = quat.normalize(quat.create(), quat.fromMat3(quat.create(), mat3.fromMat4(mat3.create(), pose)));
    const turn = [w, x, y, z].map((part) => (w < 0 ? -part : part));
    return [[name, number, "ok", "none", 0, ...mat4.getTranslation([0, 0, 0], pose), ...turn, 0, 0, 0, 0, "by hand"].join(",")];
  }));
  return [TRAJECTORY, ...rows, ""].join("\n");
}

// As --landmarks3d and --landmarks VIEW=FILE read them.
export const landmarks_csv = (landmarks: Landmark[]): string => landmarks.filter(({ ct_mm }) => ct_mm).map(({ name, ct_mm }) => [name, ...ct_mm!].join(",") + "\n").join("");
export const marks_csv = (landmarks: Landmark[], view: View, index: number): string => landmarks.filter(({ pixels, ct_mm }) => pixels[index] && ct_mm)
  .map(({ name, pixels }) => [name, ...from_camera_px(view, pixels[index]!)].join(",") + "\n").join("");

// A word of a command for a POSIX shell.
export const quoted = (word: string): string => (/^[A-Za-z0-9_@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

// What to go on with: the start, or the key frames that were moved beside those that the run had.
export function command_of(store: Store): string {
  const { scene } = store, { begin, end, key_frames } = scene.go_on;
  if (!scene.is_sequence) return [begin, "--start", scene.objects.length > 1 ? "start.csv" : "start.json", end].join(" ");
  const moved = moved_slots(store), is_moved = (object: string, frame: number) => moved.some((key) => key.object === object && key.frame === frame);
  const old = key_frames.filter(({ object, frame }) => !is_moved(object, frame)).map(({ words }) => words);
  return [begin, ...old, ...moved.map(({ object, frame }) => `--keyframe ${quoted(`${object}:${frame}=keyframes.csv`)}`), end].join(" ");
}
export const moved_slots = (store: Store): { object: string; frame: number }[] => store.scene.frames.flatMap(({ number }, f) =>
  store.scene.objects.flatMap(({ name }, o) => (store.is_moved(f, o) ? [{ object: name, frame: number }] : [])));

export function download(name: string, content: BlobPart, type: string): void {
  const link = document.createElement("a"), address = URL.createObjectURL(new Blob([content], { type }));
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

// Files opened from disk may not always use the clipboard.
export async function copy_text(text: string): Promise<void> {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}

// PNG (ISO 15948): 8 bit, grey. A canvas would make colours of it.
const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => { let c = n; for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1; return c; });
const crc32 = (bytes: Uint8Array): number => (bytes.reduce((crc, byte) => CRC_TABLE[(crc ^ byte) & 255] ^ (crc >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0;

function chunk(type: string, content: Uint8Array): Uint8Array {
  const bytes = new Uint8Array(content.length + 12), view = new DataView(bytes.buffer);
  view.setUint32(0, content.length);
  bytes.set([...type].map((letter) => letter.charCodeAt(0)), 4);
  bytes.set(content, 8);
  view.setUint32(content.length + 8, crc32(bytes.subarray(4, content.length + 8)));
  return bytes;
}
export async function png_of(width: number, height: number, grey: Uint8Array): Promise<Blob> {
  const header = new Uint8Array(13), view = new DataView(header.buffer), rows = new Uint8Array(height * (width + 1));
  view.setUint32(0, width);
  view.setUint32(4, height);
  header.set([8, 0, 0, 0, 0], 8);
  for (let y = 0; y < height; y += 1) rows.set(grey.subarray(y * width, (y + 1) * width), y * (width + 1) + 1);  // each behind a 0: not filtered
  const packed = new Uint8Array(await new Response(new Blob([rows]).stream().pipeThrough(new CompressionStream("deflate"))).arrayBuffer());
  const parts = [Uint8Array.of(137, 80, 78, 71, 13, 10, 26, 10), chunk("IHDR", header), chunk("IDAT", packed), chunk("IEND", new Uint8Array())];
  return new Blob(parts as BlobPart[], { type: "image/png" });
}
