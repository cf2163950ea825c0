// Poses, cameras and rays, as core/CONVENTIONS.md has them; in double precision.
import { glMatrix, mat3, mat4, quat, vec3 } from "gl-matrix";
import type { View, Volume } from "./data";

glMatrix.setMatrixArrayType(Array as unknown as Float32ArrayConstructor);

export type Vector = [number, number, number];
const DEGREES = 180 / Math.PI;

export function matrix_from_rows(rows: number[][]): mat4 {
  const matrix = mat4.create();
  rows.forEach((row, r) => row.forEach((value, c) => { matrix[4 * c + r] = value; }));
  return matrix;
}
export function rows_from_matrix(matrix: mat4): number[][] {
  return [0, 1, 2, 3].map((r) => [0, 1, 2, 3].map((c) => (r === 3 ? Number(c === 3) : matrix[4 * c + r])));
}
export const inverse = (matrix: mat4): mat4 => mat4.invert(mat4.create(), matrix)!;
export const product = (...matrices: mat4[]): mat4 => matrices.reduce((a, b) => mat4.multiply(mat4.create(), a, b));
export const moved_point = (matrix: mat4, point: ArrayLike<number>): Vector => vec3.transformMat4(vec3.create(), point as vec3, matrix) as Vector;

// Rounding adds up over a thousand drags: the rotation is made one again.
export function rigid(matrix: mat4): mat4 {
  const turn = quat.normalize(quat.create(), mat4.getRotation(quat.create(), matrix));
  return mat4.fromRotationTranslation(mat4.create(), turn, mat4.getTranslation(vec3.create(), matrix));
}

export function turn_about(centre: Vector, axis_rad: Vector): mat4 {
  const angle = Math.hypot(...axis_rad);
  const result = mat4.fromTranslation(mat4.create(), centre);
  if (angle > 0) mat4.rotate(result, result, angle, axis_rad);
  return mat4.translate(result, result, vec3.negate(vec3.create(), centre));
}
export const shift_by = (shift_mm: Vector): mat4 => mat4.fromTranslation(mat4.create(), shift_mm);

// K^-1 (u, v, 1): the ray of a pixel in the camera, per mm of depth.
export function camera_from_pixel(view: View): mat3 {
  const [[fx, skew, cx], [, fy, cy]] = view.intrinsics_px;
  return [1 / fx, 0, 0, -skew / (fx * fy), 1 / fy, 0, (skew * cy - cx * fy) / (fx * fy), -cy / fy, 1];
}
export const ray_of_pixel = (view: View, u: number, v: number): Vector => vec3.transformMat3(vec3.create(), [u, v, 1], camera_from_pixel(view)) as Vector;

export function pixel_of(view: View, point_camera: Vector): [number, number] {
  const [x, y, z] = point_camera, [k0, k1] = view.intrinsics_px;
  return [(k0[0] * x + k0[1] * y) / z + k0[2], (k1[1] * y) / z + k1[2]];
}

// What happens to a pose that moves by `motion`, given in the view's camera.
export function moved_in_camera(pose: mat4, view: View, motion: mat4): mat4 {
  return rigid(product(inverse(view.camera_from_world), motion, view.camera_from_world, pose));
}

export const centre_in_camera = (pose: mat4, view: View, volume: Volume): Vector =>
  moved_point(product(view.camera_from_world, pose), volume.centre_ct_mm);

export interface RayFrame { source_voxel: Vector; voxel_from_camera: mat3; camera_from_pixel: mat3 }

// All rays of a view under a pose, in voxels: make_ray_frame of core/geometry.
export function ray_frame(volume: Volume, view: View, pose: mat4): RayFrame {
  const ct_from_camera = inverse(product(view.camera_from_world, pose));
  const d = volume.direction, s = volume.spacing_mm;
  const voxel_from_ct: mat3 = [0, 1, 2].flatMap((column) => [0, 1, 2].map((axis) => d[column][axis] / s[axis])) as mat3;
  const source_ct = mat4.getTranslation(vec3.create(), ct_from_camera);
  const from_origin = vec3.subtract(vec3.create(), source_ct, volume.origin_mm as Vector);
  return {
    source_voxel: vec3.transformMat3(vec3.create(), from_origin, voxel_from_ct) as Vector,
    voxel_from_camera: mat3.multiply(mat3.create(), voxel_from_ct, mat3.fromMat4(mat3.create(), ct_from_camera)),
    camera_from_pixel: camera_from_pixel(view),
  };
}

// Of the volume, and `margin` voxels around it.
export function corners_ct(volume: Volume, margin = 0): Vector[] {
  return [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
    const voxel = [0, 1, 2].map((axis) => (corner >> axis & 1 ? volume.size[axis] - 0.5 + margin : -0.5 - margin) * volume.spacing_mm[axis]);
    return [0, 1, 2].map((row) => volume.origin_mm[row] + voxel.reduce((sum, x, axis) => sum + volume.direction[row][axis] * x, 0)) as Vector;
  });
}

export interface Box { x: number; y: number; width: number; height: number }

// Pixels, `bin` of the image's to one, whose rays can meet the object; null where none can. All where it reaches behind the source.
export function window_of(volume: Volume, view: View, pose: mat4, bin: number, size: number[]): Box | null {
  const camera_from_ct = product(view.camera_from_world, pose), corners = corners_ct(volume, 0.5).map((corner) => moved_point(camera_from_ct, corner));
  if (corners.every((corner) => corner[2] <= 0)) return null;
  if (corners.some((corner) => corner[2] <= 0)) return { x: 0, y: 0, width: size[0], height: size[1] };
  const pixels = corners.map((corner) => pixel_of(view, corner).map((p) => (p + 0.5) / bin - 0.5));
  const inside = (p: number, axis: number) => Math.min(size[axis], Math.max(0, p));
  const low = [0, 1].map((axis) => inside(Math.floor(Math.min(...pixels.map((p) => p[axis]))), axis));
  const high = [0, 1].map((axis) => inside(Math.ceil(Math.max(...pixels.map((p) => p[axis]))) + 1, axis));
  return high[0] > low[0] && high[1] > low[1] ? { x: low[0], y: low[1], width: high[0] - low[0], height: high[1] - low[1] } : null;
}

// Numbers to show and to type: where the object's centre is [mm], and R = R_z(c) R_y(b) R_x(a) [degrees].
export interface PoseNumbers { position_mm: Vector; angles_deg: Vector }

export function numbers_of(pose: mat4, volume: Volume): PoseNumbers {
  const sin_b = Math.max(-1, Math.min(1, -pose[2]));
  const angles: Vector = [Math.atan2(pose[6], pose[10]), Math.asin(sin_b), Math.atan2(pose[1], pose[0])];
  return { position_mm: moved_point(pose, volume.centre_ct_mm), angles_deg: angles.map((a) => a * DEGREES) as Vector };
}
export function pose_of_numbers({ position_mm, angles_deg }: PoseNumbers, volume: Volume): mat4 {
  const [a, b, c] = angles_deg.map((angle) => angle / DEGREES);
  const turn = mat4.create();
  mat4.rotateZ(turn, turn, c);
  mat4.rotateY(turn, turn, b);
  mat4.rotateX(turn, turn, a);
  return with_centre_at(turn, position_mm, volume);
}
export function with_centre_at(turn: mat4, position_mm: Vector, volume: Volume): mat4 {
  const centre = moved_point(turn, volume.centre_ct_mm);
  return product(shift_by(position_mm.map((x, i) => x - centre[i]) as Vector), turn);
}

// The patient as the view is to show it; rows are the camera's axes in LPS. Feet are down.
export const PRESETS: Record<string, number[][]> = {
  AP: [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]],
  PA: [[-1, 0, 0, 0], [0, 0, -1, 0], [0, -1, 0, 0], [0, 0, 0, 1]],
  "lateral from the left": [[0, 1, 0, 0], [0, 0, -1, 0], [-1, 0, 0, 0], [0, 0, 0, 1]],
  "lateral from the right": [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]],
};

// Turned so that `view` shows the preset; the object's centre stays where it is.
export function preset_pose(pose: mat4, view: View, name: string, volume: Volume): mat4 {
  const position = moved_point(pose, volume.centre_ct_mm);
  if (name === "as in the CT") return with_centre_at(mat4.create(), position, volume);
  const turn_only = product(inverse(view.camera_from_world), matrix_from_rows(PRESETS[name]));
  turn_only[12] = turn_only[13] = turn_only[14] = 0;
  return with_centre_at(rigid(turn_only), position, volume);
}
