// Pixels of a view that are to be ignored: painted by brush and polygon, handed out as the program reads them.
import type { View, XRay } from "./data";
import { to_camera_px } from "./stored";
import { png_of } from "./save";

export type Ignored = Uint8Array;  // 1 = ignored; row by row, pixels of the page's image
// null: as the X-ray's own weights say. Masks are not changed but replaced: `past` has the ones before.
export interface Mask { ignored: Ignored | null; past: (Ignored | null)[] }

const begun = new WeakMap<object, Ignored>();

// To begin with: what weighs nothing by now.
export function ignored_of(mask: Mask, view: View, xray: XRay | null): Ignored {
  const known = mask.ignored ?? begun.get(xray ?? view);
  if (known) return known;
  const result = new Uint8Array(view.size_px[0] * view.size_px[1]);
  xray?.weights?.forEach((weight, i) => { result[i] = weight > 0 ? 0 : 1; });
  begun.set(xray ?? view, result);
  return result;
}
export const changed = (mask: Mask, ignored: Ignored): Mask => ({ ignored, past: [...mask.past, mask.ignored].slice(-50) });
export const undone = ({ ignored, past }: Mask): Mask => (past.length ? { ignored: past[past.length - 1], past: past.slice(0, -1) } : { ignored, past });

// What a mask makes of an X-ray's weights: painted masks take the place of the file's.
export function weights_with(mask: Mask, xray: XRay): Float32Array {
  if (mask.ignored) return Float32Array.from(mask.ignored, (ignored, i) => (ignored ? 0 : xray.weights?.[i] || 1));
  return xray.weights ?? new Float32Array(xray.values.length).fill(1);
}

// Pixels whose centres lie within `radius_px` of the way from one place to another.
export function brushed(ignored: Ignored, [width, height]: number[], from: number[], to: number[], radius_px: number, value: number): Ignored {
  const result = ignored.slice(), [dx, dy] = [to[0] - from[0], to[1] - from[1]], length2 = dx * dx + dy * dy;
  const low = [0, 1].map((a) => Math.max(0, Math.ceil(Math.min(from[a], to[a]) - radius_px)));
  const high = [0, 1].map((a) => Math.min([width, height][a] - 1, Math.floor(Math.max(from[a], to[a]) + radius_px)));
  for (let y = low[1]; y <= high[1]; y += 1) for (let x = low[0]; x <= high[0]; x += 1) {
    const share = length2 > 0 ? Math.min(1, Math.max(0, ((x - from[0]) * dx + (y - from[1]) * dy) / length2)) : 0;
    if (Math.hypot(x - from[0] - share * dx, y - from[1] - share * dy) <= radius_px) result[y * width + x] = value;
  }
  return result;
}

// Pixels whose centres lie inside, by crossings to the right.
export function filled(ignored: Ignored, [width, height]: number[], corners: number[][], value: number): Ignored {
  const result = ignored.slice();
  for (let y = 0; y < height; y += 1) for (let x = 0; x < width; x += 1) {
    let inside = false;
    corners.forEach(([ax, ay], i) => {
      const [bx, by] = corners[(i + 1) % corners.length];
      if (ay > y !== by > y && x < ax + ((y - ay) * (bx - ax)) / (by - ay)) inside = !inside;
    });
    if (inside) result[y * width + x] = value;
  }
  return result;
}

// PNG of the size of the stored X-ray: 0 = ignored, 255 = used.
export function mask_png(view: View, ignored: Ignored): Promise<Blob> {
  const [width, height] = view.stored.size_px, [columns, rows] = view.size_px, grey = new Uint8Array(width * height);
  const near = (value: number, count: number) => Math.min(count - 1, Math.max(0, Math.round(value)));
  for (let y = 0; y < height; y += 1) for (let x = 0; x < width; x += 1) {
    const [u, v] = to_camera_px(view, [x, y]);
    grey[y * width + x] = ignored[near(v, rows) * columns + near(u, columns)] ? 0 : 255;
  }
  return png_of(width, height, grey);
}
