// What the program wrote into the page, unpacked.
import type { mat4 } from "gl-matrix";
import { matrix_from_rows } from "./geometry";

export interface Volume {
  size: [number, number, number];
  spacing_mm: number[];
  origin_mm: number[];
  direction: number[][];  // rows
  per_mm: number;         // attenuation that 255 stands for
  halvings: number;
  centre_ct_mm: number[];
  radius_mm: number;
  values: Uint8Array;     // x fastest
}
// What has a pose of its own.
export interface SceneObject { name: string; moves: boolean; volume: Volume }

export interface Pixels { width: number; height: number; values: Float32Array }
export interface XRay extends Pixels { weights: Float32Array | null }  // null: all ones

export type Flip = "none" | "columns" | "rows";
export interface View {
  name: string;
  size_px: [number, number];
  intrinsics_px: number[][];
  camera_from_world: mat4;
  sdd_mm: number | null;
  halvings: number;
  // How the pixels of the file lie: points and masks that are handed out are counted in them.
  stored: { size_px: [number, number]; flip: Flip; distortion: number[] | null };
}

// One instant; with a sequence there are several.
export interface Frame {
  number: number;
  poses: mat4[];                         // world_from_ct of the objects
  status: string[];                      // of the objects; "" where nobody judged them
  xrays: () => Promise<(XRay | null)[]>; // unpacked when asked for: a sequence is long
}

// The command to go on with is begin + what the page hands out + end.
export interface GoOn { begin: string; end: string; key_frames: { object: string; frame: number; words: string }[] }

export interface Scene {
  title: string;
  is_sequence: boolean;
  objects: SceneObject[];
  views: View[];
  frames: Frame[];
  go_on: GoOn;
  folder: string;             // where that command is given
  notes: string[];
}

async function unpacked(base64: string): Promise<Uint8Array> {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i += 1) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The one place where the page's JSON is taken as it is: the program wrote it.
type Json = any;

async function xray_of(json: Json, [width, height]: number[]): Promise<XRay | null> {
  if (!json) return null;
  const bytes = await unpacked(json.data), step = json.bytes, most = 256 ** step - 1;
  const values = new Float32Array(width * height);
  for (let i = 0; i < values.length; i += 1) {
    const level = step === 1 ? bytes[i] : bytes[2 * i] + 256 * bytes[2 * i + 1];
    values[i] = json.low + (json.high - json.low) * (level / most);
  }
  const weights = json.weights ? Float32Array.from(await unpacked(json.weights), (w) => w / 255) : null;
  return { width, height, values, weights };
}

async function object_of(json: Json): Promise<SceneObject> {
  return { name: json.name, moves: json.moves, volume: { ...json, values: await unpacked(json.data) } };
}

const frame_of = (json: Json, views: Json[]): Frame => ({
  number: json.number, status: json.status, poses: json.poses.map(matrix_from_rows),
  xrays: () => Promise.all(views.map((view, i) => xray_of(json.xrays[i], view.size_px))),
});

export async function read_scene(json: Json): Promise<Scene> {
  const objects = await Promise.all<SceneObject>(json.objects.map(object_of));
  const views = json.views.map((view: Json) => ({ ...view, camera_from_world: matrix_from_rows(view.camera_from_world) }));
  return { ...json, objects, views, frames: json.frames.map((frame: Json) => frame_of(frame, json.views)) };
}
