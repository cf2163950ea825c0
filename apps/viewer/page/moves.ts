// What a hand does becomes a motion of the object, seen by one view.
import type { mat4 } from "gl-matrix";
import type { View, Volume } from "./data";
import { centre_in_camera, moved_in_camera, pixel_of, ray_of_pixel, shift_by, turn_about, type Vector } from "./geometry";

export const DEGREES_PER_PIXEL = 0.25;  // of the screen, for turns about axes in the plane
const RADIANS = Math.PI / 180;

const unit = (v: Vector): Vector => v.map((x) => x / Math.hypot(...v)) as Vector;

// In the view's plane, true to depth: the object's centre follows the pointer. `by_px`: of the image.
export function drag_in_plane(pose: mat4, view: View, volume: Volume, by_px: [number, number]): mat4 {
  const depth_mm = centre_in_camera(pose, view, volume)[2];
  const here = ray_of_pixel(view, 0, 0), there = ray_of_pixel(view, ...by_px);
  return moved_in_camera(pose, view, shift_by(here.map((x, i) => depth_mm * (there[i] - x)) as Vector));
}

// Along the ray from the source through the object's centre; away from the source is positive.
export function move_in_depth(pose: mat4, view: View, volume: Volume, by_mm: number): mat4 {
  const ray = unit(centre_in_camera(pose, view, volume));
  return moved_in_camera(pose, view, shift_by(ray.map((x) => by_mm * x) as Vector));
}

// About that ray; clockwise on the screen is positive.
export function turn_in_plane(pose: mat4, view: View, volume: Volume, by_deg: number): mat4 {
  const centre = centre_in_camera(pose, view, volume);
  const axis = unit(centre).map((x) => by_deg * RADIANS * x) as Vector;
  return moved_in_camera(pose, view, turn_about(centre, axis));
}

// About the camera's axes through the object's centre: the side that faces the source follows the pointer.
export function turn_out_of_plane(pose: mat4, view: View, volume: Volume, right_deg: number, down_deg: number): mat4 {
  const centre = centre_in_camera(pose, view, volume);
  return moved_in_camera(pose, view, turn_about(centre, [down_deg * RADIANS, -right_deg * RADIANS, 0]));
}

// Angle by which the pointer went around the object's centre on its way from one place of the image to another.
export function angle_around_centre_deg(pose: mat4, view: View, volume: Volume, from: number[], to: number[]): number {
  const [u, v] = pixel_of(view, centre_in_camera(pose, view, volume));
  const angle = Math.atan2(to[1] - v, to[0] - u) - Math.atan2(from[1] - v, from[0] - u);
  return Math.atan2(Math.sin(angle), Math.cos(angle)) / RADIANS;
}

// Millimetres in the view's plane, along columns and rows.
export function shift_in_plane(pose: mat4, view: View, right_mm: number, down_mm: number): mat4 {
  return moved_in_camera(pose, view, shift_by([right_mm, down_mm, 0]));
}
