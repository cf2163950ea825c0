// The state of the page: here and nowhere else.
import type { mat4 } from "gl-matrix";
import type { Scene, View, Volume } from "./data";
import type { Landmark } from "./landmarks";
import { centre_in_camera, corners_ct, moved_point, pixel_of, product } from "./geometry";
import type { Mask } from "./masks";

export const MODES = ["blend", "checkerboard", "curtain", "edges", "difference"] as const;
export type Mode = (typeof MODES)[number];

// Where a panel looks: the image pixel in its middle, and image pixels per CSS pixel of it.
export interface Zoom { centre_px: [number, number]; px_per_css: number }
export interface Window { low: number; high: number }

// The pose (world_from_ct) of an object in a frame, and the ones before and after it.
export interface Slot { pose: mat4; past: mat4[]; future: mat4[] }

// What a click or drag without other keys does.
export type Tool = "move" | "brush" | "polygon";

export interface State {
  slots: Slot[][];                 // by frame, by object
  frame: number;                   // the one shown: its position in the scene
  object: number;                  // the one that hands and numbers move
  active: number;                  // view that keys and presets refer to
  mode: Mode;
  share: number;
  step: number;                    // of keys and the wheel, mm or degrees
  mirrored: boolean;               // shown as if the reader stood at the detector
  zooms: (Zoom | null)[];          // null: the whole picture
  xray_windows: Window[];          // of the views, as shares of their range
  drr_window: Window;
  has_lens: boolean;
  lens: { view: number; at_css: number[] } | null;  // where the pointer is
  correlations: (number | null)[]; // gradient correlation of the views; null: no X-ray
  rough: boolean;                  // correlations of coarser images, while something moves
  nudging: boolean;
  landmarks: Landmark[];
  marking: number | null;          // the landmark that clicks mark; null: they move the object
  tool: Tool;
  brush_px: number;                // radius, pixels of the image
  erases: boolean;                 // brush and polygon take pixels in again
  masks: Mask[];
  polygon: { view: number; corners: number[][] } | null;
  trouble: string;                 // why there are no live DRRs; "" = there are
}

type Listener = (state: State, before: State) => void;

export class Store {
  private listeners: Listener[] = [];
  constructor(readonly scene: Scene, private current: State) {}
  get state(): State { return this.current; }
  get slot(): Slot { return this.current.slots[this.current.frame][this.current.object]; }
  get pose(): mat4 { return this.slot.pose; }
  get poses(): mat4[] { return this.current.slots[this.current.frame].map((slot) => slot.pose); }
  get volume(): Volume { return this.scene.objects[this.current.object].volume; }

  set(change: Partial<State>): void {
    const before = this.current;
    this.current = { ...before, ...change };
    this.listeners.forEach((listener) => listener(this.current, before));
  }
  listen(listener: Listener): () => void {
    this.listeners.push(listener);
    return () => { this.listeners = this.listeners.filter((other) => other !== listener); };
  }
  private put(change: Partial<Slot>): void {
    const { frame, object, slots } = this.current;
    this.set({ slots: slots.map((row, f) => (f === frame ? row.map((slot, o) => (o === object ? { ...slot, ...change } : slot)) : row)) });
  }
  // On the way of a drag: not kept.
  show(pose: mat4): void { this.put({ pose }); }
  // A pose that undo comes back from. After a drag `from` is where it began: only its end is kept.
  move(pose: mat4, from: mat4 = this.pose): void { this.put({ pose, past: [...this.slot.past, from].slice(-500), future: [] }); }
  undo(): void {
    const { past, future, pose } = this.slot;
    if (past.length) this.put({ pose: past[past.length - 1], past: past.slice(0, -1), future: [pose, ...future] });
  }
  redo(): void {
    const { past, future, pose } = this.slot;
    if (future.length) this.put({ pose: future[0], past: [...past, pose], future: future.slice(1) });
  }
  get start(): mat4 { return this.scene.frames[this.current.frame].poses[this.current.object]; }
  // Whether an object stands elsewhere in a frame than the program had it.
  is_moved(frame: number, object: number): boolean {
    const here = this.current.slots[frame][object].pose, start = this.scene.frames[frame].poses[object];
    return Array.from(here).some((x, i) => Math.abs(x - start[i]) > 1e-9);
  }
}

export function first_state(scene: Scene): State {
  return {
    slots: scene.frames.map((frame) => frame.poses.map((pose) => ({ pose, past: [], future: [] }))), frame: 0, object: Math.max(0, scene.objects.findIndex(({ moves }) => moves)),
    active: 0, mode: "blend", share: 0.5, step: 1, mirrored: false,
    zooms: scene.views.map(() => null), xray_windows: scene.views.map(() => ({ low: 0, high: 1 })), drr_window: { low: 0, high: 1 }, has_lens: false, lens: null,
    correlations: scene.views.map(() => null), rough: false, nudging: false, landmarks: [], marking: null,
    tool: "move", brush_px: 8, erases: false, masks: scene.views.map(() => ({ ignored: null, past: [] })), polygon: null, trouble: "",
  };
}

// The whole picture, in the middle of the panel.
export function fit([width, height]: number[], panel_css: number[]): Zoom {
  return { centre_px: [(width - 1) / 2, (height - 1) / 2], px_per_css: Math.max(width / panel_css[0], height / panel_css[1]) };
}

// What the picture shows of the object chosen, with a margin, as the pose projects its box; null (the whole picture) where it shows nothing.
export function zoom_to_object(store: Store, view: View, panel_css: number[]): Zoom | null {
  const { pose, volume } = store, camera_from_ct = product(view.camera_from_world, pose);
  if (centre_in_camera(pose, view, volume)[2] <= 0) return null;
  const corners = corners_ct(volume).map((corner) => moved_point(camera_from_ct, corner)).filter((corner) => corner[2] > 0);
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
