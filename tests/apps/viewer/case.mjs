// A small case without any symmetry: blobs in a volume that lies obliquely, two views with skew and principal points far off centre.
import { readFileSync, writeFileSync } from "node:fs";
import { inflateSync } from "node:zlib";
import { run } from "./browser.mjs";
import { euler, product, shift } from "./linear.mjs";

const SIZE = [44, 38, 30], SPACING_MM = [2.1, 2.6, 3.3];
const BLOBS = [[12, 10, 8, 6, 0.03], [30, 12, 20, 5, 0.05], [20, 28, 12, 7, 0.025], [34, 30, 7, 3, 0.08], [8, 25, 23, 4, 0.06]];

export const POSES = [[0.3, -0.5, 1.1, 4, -7, 9], [-1.4, 0.7, 0.2, -12, 5, 3], [2.2, 0.4, -0.9, 8, 10, -14]]
  .map(([a, b, c, ...t]) => product(shift(t), euler(a, b, c)));

export function write_mha(path, { size, spacing_mm, origin_mm, direction }, values) {
  const numbers = (list) => list.map(String).join(" ");
  const columns = [0, 1, 2].flatMap((c) => [0, 1, 2].map((r) => direction[r][c]));
  const header = `ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n` +
    `TransformMatrix = ${numbers(columns)}\nOffset = ${numbers(origin_mm)}\nElementSpacing = ${numbers(spacing_mm)}\nDimSize = ${numbers(size)}\n` +
    `ElementType = MET_FLOAT\nElementDataFile = LOCAL\n`;
  writeFileSync(path, Buffer.concat([Buffer.from(header), Buffer.from(Float32Array.from(values).buffer)]));
}
export const write_json = (path, value) => writeFileSync(path, JSON.stringify(value));
export const write_pose = (path, world_from_ct) => write_json(path, { raylign: 1, world_from_ct });

function blobs() {
  const values = [];
  for (let z = 0; z < SIZE[2]; z += 1) for (let y = 0; y < SIZE[1]; y += 1) for (let x = 0; x < SIZE[0]; x += 1) {
    const density = BLOBS.reduce((sum, [bx, by, bz, r, mu]) => {
      const d = Math.hypot((x - bx) * SPACING_MM[0], (y - by) * SPACING_MM[1], (z - bz) * SPACING_MM[2]) / (2.5 * r);
      return sum + (d < 1 ? mu * (1 - d * d) : 0);
    }, 0);
    values.push(density);
  }
  return values;
}

// Sheared pixels, the principal point far off centre; one view knows its detector, one is a projection matrix.
function geometry() {
  const first = product(shift([15, -20, 700]), euler(0.4, -0.3, 0.9)), second = product(shift([-25, 10, 900]), euler(-0.8, 1.0, 0.3));
  const k = [[760, 9, 31.5], [0, 730, 84.25], [0, 0, 1]], other = [[1010, -14, 92.75], [0, 980, 22.5], [0, 0, 1]];
  const projection_matrix = product(other, second.slice(0, 3));
  return { raylign: 1, views: [
    { name: "first", intrinsics: k, sdd_mm: 1000, size_px: [128, 112], camera_from_world: first },
    { name: "second", projection_matrix, size_px: [104, 120] }] };
}

// Leaves ct.mha, geometry.json, truth.json and xrays/ in the working folder.
export function make_case() {
  write_mha("ct.mha", { size: SIZE, spacing_mm: SPACING_MM, origin_mm: [-50, -40, -55], direction: euler(0.5, -0.4, 0.7).slice(0, 3).map((row) => row.slice(0, 3)) }, blobs());
  write_json("geometry.json", geometry());
  write_pose("truth.json", POSES[0]);
  run(["drr", "-v", "ct.mha", "--attenuation", "--views", "geometry.json", "--pose", "truth.json", "-o", "xrays", "--quiet"]);
}

// What a page carries.
export function page_data(file) {
  const html = readFileSync(file, "utf8");
  const data = JSON.parse(/<script type="application\/json" id="data">([^]*?)<\/script>/.exec(html)[1]);
  return { ...data, volume: data.objects?.[0], start: data.frames?.[0].poses[0] };
}
export function embedded_values(volume) {
  return Float32Array.from(inflateSync(Buffer.from(volume.data, "base64")), (n) => (n / 255) * volume.per_mm);
}

// Float32 pixels of a TIFF as the program writes them: one sample, little endian, not packed.
export function read_tiff(path) {
  const file = readFileSync(path), tags = {};
  const at = file.readUInt32LE(4), count = file.readUInt16LE(at);
  const number = (offset, type, k) => (type === 3 ? file.readUInt16LE(offset + 2 * k) : file.readUInt32LE(offset + 4 * k));
  for (let i = 0; i < count; i += 1) {
    const entry = at + 2 + 12 * i, type = file.readUInt16LE(entry + 2), n = file.readUInt32LE(entry + 4);
    const where = n * (type === 3 ? 2 : 4) <= 4 ? entry + 8 : file.readUInt32LE(entry + 8);
    tags[file.readUInt16LE(entry)] = type === 3 || type === 4 ? Array.from({ length: n }, (_, k) => number(where, type, k)) : [];
  }
  if ((tags[259] ?? [1])[0] !== 1 || tags[258][0] !== 32) throw new Error(`${path}: not plain float32`);
  const strips = tags[273].map((offset, i) => file.subarray(offset, offset + tags[279][i])), bytes = Buffer.concat(strips);
  return { width: tags[256][0], height: tags[257][0], values: new Float32Array(new Uint8Array(bytes).buffer) };
}
