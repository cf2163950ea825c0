// Pixels of the page's images and pixels of the files: halved, undistorted and turned over on the way in.
import type { View } from "./data";
import { pixel_of, ray_of_pixel } from "./geometry";

// OpenCV's rational model: raylign/io/geometry.h.
function distorted_ray([k1, k2, p1, p2, k3, k4, k5, k6]: number[], [x, y]: number[]): [number, number] {
  const r2 = x * x + y * y, f = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  return [f * x + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), f * y + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y];
}
// By fixed-point steps: distortion of X-rays is weak.
function undistorted_ray(distortion: number[], target: number[]): [number, number] {
  let [x, y] = target;
  for (let i = 0; i < 30; i += 1) {
    const [dx, dy] = distorted_ray(distortion, [x, y]);
    [x, y] = [x + target[0] - dx, y + target[1] - dy];
  }
  return [x, y];
}

const turned_over = ({ stored: { size_px, flip } }: View, [x, y]: number[]): [number, number] =>
  [flip === "columns" ? size_px[0] - 1 - x : x, flip === "rows" ? size_px[1] - 1 - y : y];

// A pixel of the page's image, counted in the file's.
export function from_camera_px(view: View, pixel: number[]): [number, number] {
  const { distortion } = view.stored, scale = 2 ** view.halvings;
  const seen = distortion ? pixel_of(view, [...distorted_ray(distortion, ray_of_pixel(view, pixel[0], pixel[1])), 1]) : pixel;
  return turned_over(view, seen.map((x) => scale * x + (scale - 1) / 2));
}
// The other way.
export function to_camera_px(view: View, stored_px: number[]): [number, number] {
  const { distortion } = view.stored, scale = 2 ** view.halvings;
  const [u, v] = turned_over(view, stored_px).map((x) => (x - (scale - 1) / 2) / scale);
  return distortion ? pixel_of(view, [...undistorted_ray(distortion, ray_of_pixel(view, u, v)), 1]) : [u, v];
}
