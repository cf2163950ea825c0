// The state of the page: here and nowhere else.
import type { mat4 } from "gl-matrix";
import type { Scene, View } from "./data";
import type { Landmark } from "./landmarks";
import { centre_in_camera, corners_ct, moved_point, pixel_of, product } from "./geometry";

export const MODES = ["blend", "checkerboard", "curtain", "edges", "difference"] as const;
export type Mode = (typeof MODES)[number];

// Where a panel looks: the image pixel in its middle, and image pixels per CSS pixel of it.
export interface Zoom { centre_px: [number, number]; px_per_css: number }
export interface Window { low: number; high: number }

export interface State {
  pose: mat4;                      // world_from_ct
  past: mat4[];
  future: mat4[];
  active: number;                  // view that keys and presets refer to
  mode: Mode;
  share: number;
  step: number;                    // of keys and the wheel, mm or degrees
  mirrored: boolean;               // shown as if the reader stood at the detector
  zooms: (Zoom | null)[];          // null: the whole picture
  xray_windows: Window[];          // of the views, as shares of their range
  drr_window: Window;
  correlations: (number | null)[]; // gradient correlation of the views; null: no X-ray
  rough: boolean;                  // correlations of coarser images, while something moves
  nudging: boolean;
  landmarks: Landmark[];
  marking: number | null;          // the landmark that clicks mark; null: they move the object
  trouble: string;                 // why there are no live DRRs; "" = there are
}

type Listener = (state: State, before: State) => void;

export class Store {
  private listeners: Listener[] = [];
  constructor(readonly scene: Scene, private current: State) {}
  get state(): State { return this.current; }
  set(change: Partial<State>): void {
    const before = this.current;
    this.current = { ...before, ...change };
    this.listeners.forEach((listener) => listener(this.current, before));
  }
  listen(listener: Listener): () => void {
    this.listeners.push(listener);
    return () => { this.listeners = this.listeners.filter((other) => other !== listener); };
  }
  // A pose that undo comes back from. While a drag goes on, `from` is where it began, and only its end is kept.
  move(pose: mat4, from: mat4 = this.state.pose): void {
    this.set({ pose, past: [...this.state.past, from].slice(-500), future: [] });
  }
  undo(): void {
    const { past, future, pose } = this.state;
    if (past.length) this.set({ pose: past[past.length - 1], past: past.slice(0, -1), future: [pose, ...future] });
  }
  redo(): void {
    const { past, future, pose } = this.state;
    if (future.length) this.set({ pose: future[0], past: [...past, pose], future: future.slice(1) });
  }
}

export function first_state(scene: Scene): State {
  return {
    pose: scene.start, past: [], future: [], active: 0, mode: "blend", share: 0.5, step: 1, mirrored: false,
    zooms: scene.views.map(() => null), xray_windows: scene.views.map(() => ({ low: 0, high: 1 })), drr_window: { low: 0, high: 1 },
    correlations: scene.views.map(() => null), rough: false, nudging: false, landmarks: [], marking: null, trouble: "",
  };
}

// The whole picture, in the middle of the panel.
export function fit([width, height]: number[], panel_css: number[]): Zoom {
  return { centre_px: [(width - 1) / 2, (height - 1) / 2], px_per_css: Math.max(width / panel_css[0], height / panel_css[1]) };
}

// What the picture shows of the object, with a margin, as the pose projects its box; null (the whole picture) where it shows nothing.
export function zoom_to_object(store: Store, view: View, panel_css: number[]): Zoom | null {
  const { scene, state } = store;
  const camera_from_ct = product(view.camera_from_world, state.pose);
  if (centre_in_camera(state.pose, view, scene.volume)[2] <= 0) return null;
  const corners = corners_ct(scene.volume).map((corner) => moved_point(camera_from_ct, corner)).filter((corner) => corner[2] > 0);
  const pixels = corners.map((corner) => pixel_of(view, corner));
  const inside = (value: number, axis: number) => Math.min(view.size_px[axis] - 1, Math.max(0, value));
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1].map((axis) => inside(pick(...pixels.map((p) => p[axis])), axis)));
  if (!(high[0] > low[0] && high[1] > low[1])) return null;
  const size = [0, 1].map((axis) => 1.1 * (high[axis] - low[axis]));
  return { centre_px: [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2], px_per_css: Math.max(size[0] / panel_css[0], size[1] / panel_css[1]) };
}

// image = factor * panel + offset, per axis, in CSS pixels of the panel.
export function image_from_panel(zoom: Zoom, panel_css: number[], mirrored: boolean): [number, number, number, number] {
  const fx = mirrored ? -zoom.px_per_css : zoom.px_per_css, fy = zoom.px_per_css;
  return [fx, fy, zoom.centre_px[0] - (fx * panel_css[0]) / 2, zoom.centre_px[1] - (fy * panel_css[1]) / 2];
}
