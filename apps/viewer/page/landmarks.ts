// Points marked in X-rays and in the CT, and the pose that lays the ones on the others.
import type { mat4 } from "gl-matrix";
import type { Scene, View, Volume } from "./data";
import { moved_point, centre_in_camera, inverse, pixel_of, PRESETS, product, preset_pose, ray_of_pixel, rigid, shift_by, turn_about, with_centre_at, type Vector } from "./geometry";

export interface Landmark { name: string; ct_mm: Vector | null; pixels: ([number, number] | null)[] }

export const point_of_voxel = (volume: Volume, voxel: number[]): Vector => [0, 1, 2].map((row) =>
  volume.origin_mm[row] + voxel.reduce((sum, x, axis) => sum + volume.direction[row][axis] * volume.spacing_mm[axis] * x, 0)) as Vector;

// Two pixels of `view` on the line where it sees the ray of a pixel of `other`; null where the ray passes its source.
export function epipolar_line(volume: Volume, pose: mat4, view: View, other: View, pixel: [number, number]): [number, number][] | null {
  const depth = centre_in_camera(pose, other, volume)[2], ray = ray_of_pixel(other, ...pixel);
  const view_from_other = product(view.camera_from_world, inverse(other.camera_from_world));
  const points = [0.9, 1.1].map((share) => moved_point(view_from_other, ray.map((x) => share * depth * x)));
  return points.every((point) => point[2] > 0) ? points.map((point) => pixel_of(view, point)) : null;
}

interface Pair { view: View; ct_mm: Vector; pixel: [number, number] }

export function pairs_of(scene: Scene, landmarks: Landmark[]): Pair[] {
  return landmarks.flatMap(({ ct_mm, pixels }) => pixels.flatMap((pixel, i) => (ct_mm && pixel ? [{ view: scene.views[i], ct_mm, pixel }] : [])));
}

// Three points fix a pose, seen in one view at least three times, or in several at least twice each.
export const are_enough = (landmarks: Landmark[], pairs: Pair[]): boolean =>
  landmarks.filter(({ ct_mm, pixels }) => ct_mm && pixels.some(Boolean)).length >= 3 && pairs.length >= 3;

function residuals(pairs: Pair[], pose: mat4): number[] | null {
  const list: number[] = [];
  for (const { view, ct_mm, pixel } of pairs) {
    const point = moved_point(product(view.camera_from_world, pose), ct_mm);
    if (point[2] <= 0) return null;
    const seen = pixel_of(view, point);
    list.push(seen[0] - pixel[0], seen[1] - pixel[1]);
  }
  return list;
}
const squares = (list: number[] | null): number => (list ? list.reduce((sum, x) => sum + x * x, 0) : Infinity);

// The twist (turns about the object's centre by rad, shifts by mm) applied to a pose.
function moved(pose: mat4, volume: Volume, twist: number[]): mat4 {
  const centre = moved_point(pose, volume.centre_ct_mm);
  return rigid(product(shift_by(twist.slice(3) as Vector), turn_about(centre, twist.slice(0, 3) as Vector), pose));
}

// Gaussian elimination with pivots; null where the matrix is singular.
function solved(matrix: number[][], right: number[]): number[] | null {
  const rows = matrix.map((row, i) => [...row, right[i]]);
  for (let k = 0; k < 6; k += 1) {
    const best = rows.slice(k).reduce((at, row, i) => (Math.abs(row[k]) > Math.abs(rows[at][k]) ? k + i : at), k);
    [rows[k], rows[best]] = [rows[best], rows[k]];
    if (!(Math.abs(rows[k][k]) > 0)) return null;
    for (let i = 0; i < 6; i += 1) {
      if (i === k) continue;
      const share = rows[i][k] / rows[k][k];
      rows[i] = rows[i].map((x, c) => x - share * rows[k][c]);
    }
  }
  return rows.map((row, k) => row[6] / row[k]);
}

// Levenberg and Marquardt's steps down the squared distances in pixels.
function descended(pairs: Pair[], volume: Volume, start: mat4): { pose: mat4; squares: number } {
  let pose = start, list = residuals(pairs, pose), damping = 1e-3;
  const h = [1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3];
  for (let step = 0; step < 100 && list && damping < 1e9; step += 1) {
    const here: number[] = list;
    const slopes = h.map((size, p) => { const there = residuals(pairs, moved(pose, volume, h.map((_, k) => (k === p ? size : 0)))) ?? here; return there.map((x, i) => (x - here[i]) / size); });
    const normal = slopes.map((a, r) => slopes.map((b, c) => a.reduce((sum, x, i) => sum + x * b[i], 0) * (r === c ? 1 + damping : 1)));
    const twist = solved(normal, slopes.map((a) => -a.reduce((sum, x, i) => sum + x * here[i], 0)));
    const next = twist && moved(pose, volume, twist), there = next && residuals(pairs, next);
    if (next && there && squares(there) < squares(here)) {
      const gain = squares(here) - squares(there);
      [pose, list, damping] = [next, there, damping / 5];
      if (gain < 1e-14 * squares(there) + 1e-20) break;
    } else {
      damping *= 4;
    }
  }
  return { pose, squares: squares(list) };
}

// From here, and from the patient turned as each preset shows him in each view: the nearest of where they end. rms in pixels.
export function pose_by_landmarks(scene: Scene, volume: Volume, landmarks: Landmark[], here: mat4): { pose: mat4; rms_px: number } {
  const pairs = pairs_of(scene, landmarks), centre = moved_point(here, volume.centre_ct_mm);
  const starts = [here, ...scene.views.flatMap((view) => Object.keys(PRESETS).map((name) => preset_pose(here, view, name, volume)))];
  const upside_down = starts.map((pose) => with_centre_at(product(turn_about([0, 0, 0], [Math.PI, 0, 0]), pose), centre, volume));
  const ends = [...starts, ...upside_down].map((start) => descended(pairs, volume, start));
  const best = ends.reduce((a, b) => (b.squares < a.squares ? b : a));
  return { pose: best.pose, rms_px: Math.sqrt(best.squares / pairs.length) };
}
