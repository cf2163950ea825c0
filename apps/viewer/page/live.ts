// Keeps what is shown up to date with the state: rough DRRs while something moves, full ones when it rests.
import type { mat4 } from "gl-matrix";
import { Pyramid, correlation } from "./correlation";
import type { Pixels, XRay } from "./data";
import { Engine, type Range } from "./engine";
import { draw_marks } from "./marks";
import { ignored_of, weights_with, type Ignored } from "./masks";
import { fit, image_from_panel, type State, type Store, type Zoom } from "./state";

const SLOW_MS = 90, FAST_MS = 25, REST_MS = 180, COARSEST = 3, SMALLEST_PX = 48;
const IGNORED = [210, 30, 40, 90];  // colour, and how much of it

// The 1st to the 99.5th percentile of what is not 0: a few hot pixels do not spoil the contrast.
export function range_of(values: Float32Array): Range {
  const sorted = values.filter((value) => value !== 0 && Number.isFinite(value)).sort();
  if (!sorted.length) return { low: 0, high: 1 };
  const low = sorted[Math.floor(0.01 * (sorted.length - 1))], high = sorted[Math.floor(0.995 * (sorted.length - 1))];
  return { low, high: high > low ? high : low + 1 };
}

function sum_of(drrs: Pixels[]): Pixels {
  if (drrs.length === 1) return drrs[0];
  const values = drrs[0].values.slice();
  for (const drr of drrs.slice(1)) drr.values.forEach((value, i) => { values[i] += value; });
  return { ...drrs[0], values };
}

function is_in_sight(panel: HTMLCanvasElement): boolean {
  const { top, bottom } = panel.getBoundingClientRect();
  return bottom > 0 && top < innerHeight;
}

interface Cast { pose: mat4; halvings: number; drr: Pixels }

export class Live {
  engine: Engine | null = null;
  readonly panels: (HTMLCanvasElement | null)[];
  private pyramids: (Pyramid | null)[] = [];
  private xray_ranges: Range[] = [];
  private drr_ranges: Range[];
  private casts: (Cast | null)[][];  // by view, by object: one that stays is not cast anew
  private drawn: { poses: mat4[]; object: number } | null = null;
  private coarse = 0;                // halvings while something moves
  private asked = false;
  private rest = 0;
  private wanted_frame = 0;
  private composed: unknown[][] = [];  // of each panel, what it was drawn from
  private pictures = new WeakMap<Ignored, HTMLCanvasElement>();  // of masks
  frame_ms = 0;                      // the last rough one

  constructor(readonly store: Store, public xrays: (XRay | null)[]) {
    const { views } = store.scene;
    this.panels = views.map(() => null);
    this.drr_ranges = views.map(() => ({ low: 0, high: 1 }));
    this.casts = this.no_casts();
    this.take_xrays(xrays);
    this.start();
    store.listen((now, before) => this.changed(now, before));
  }

  private no_casts(): (Cast | null)[][] { return this.store.scene.views.map(() => this.store.scene.objects.map(() => null)); }

  private start(): void {
    try {
      this.engine = new Engine(this.store.scene, this.xrays, () => this.store.set({ trouble: "the browser has taken the graphics away for now (WebGL context lost); it gives them back by itself" }),
        (trouble) => { this.forget(); this.store.set({ trouble }); });
    } catch (error) {
      this.store.set({ trouble: (error as Error).message });
    }
  }

  private forget(): void {
    this.drawn = null;
    this.casts = this.no_casts();
  }

  private take_xrays(xrays: (XRay | null)[]): void {
    this.xrays = xrays;
    this.xray_ranges = xrays.map((xray) => (xray ? range_of(xray.values) : { low: 0, high: 1 }));
    this.take_masks();
  }
  private take_masks(): void {
    const { views } = this.store.scene, { masks } = this.store.state;
    this.pyramids = this.xrays.map((xray, i) => (xray ? new Pyramid(views[i], xray, weights_with(masks[i], xray)) : null));
    this.drawn = null;
  }

  private changed(now: State, before: State): void {
    if (now.masks !== before.masks) this.take_masks();
    this.ask();
  }

  // Shows another frame; of several asked for quickly the last.
  async go_to(frame: number): Promise<void> {
    this.wanted_frame = frame;
    const xrays = await this.store.scene.frames[frame].xrays();
    if (this.wanted_frame !== frame) return;
    this.take_xrays(xrays);
    this.engine?.set_xrays(xrays);
    this.store.set({ frame });
  }

  ask(): void {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }

  zoom_of(view: number, size_css: number[]): Zoom { return this.store.state.zooms[view] ?? fit(this.store.scene.views[view].size_px, size_css); }

  panel_size(view: number): number[] {
    const box = this.panels[view]?.getBoundingClientRect();
    return box && box.width > 0 && box.height > 0 ? [box.width, box.height] : [1, 1];
  }
  image_from_panel(view: number): [number, number, number, number] {
    const size = this.panel_size(view);
    return image_from_panel(this.zoom_of(view, size), size, this.store.state.mirrored);
  }

  // Of what a view ignores, to be laid over it; null where that is nothing.
  mask_picture(view: number): HTMLCanvasElement | null {
    const { size_px } = this.store.scene.views[view], ignored = ignored_of(this.store.state.masks[view], this.store.scene.views[view], this.xrays[view]);
    if (!ignored.includes(1)) return null;
    const known = this.pictures.get(ignored);
    if (known) return known;
    const canvas = document.createElement("canvas"), picture = new ImageData(...size_px);
    [canvas.width, canvas.height] = size_px;
    ignored.forEach((is_ignored, i) => { if (is_ignored) picture.data.set(IGNORED, 4 * i); });
    canvas.getContext("2d")!.putImageData(picture, 0, 0);
    this.pictures.set(ignored, canvas);
    return canvas;
  }

  private is_drawn(): boolean {
    const { drawn, store } = this;
    return drawn !== null && drawn.object === store.state.object && store.poses.every((pose, i) => pose === drawn.poses[i]);
  }
  // Nothing moves, and what is shown is the full picture of the state.
  get at_rest(): boolean {
    const { state } = this.store;
    return state.trouble !== "" || (this.is_drawn() && !state.rough && !state.nudging && this.wanted_frame === state.frame);
  }

  private draw(): void {
    if (!this.engine) this.draw_xrays();
    if (!this.engine || this.engine.lost) return;
    if (!this.is_drawn()) this.cast_all(this.coarse);
    this.compose_all();
  }

  // Without WebGL there are at least the X-rays.
  private draw_xrays(): void {
    this.panels.forEach((panel, view) => {
      const image = this.xrays[view], { low, high } = this.xray_ranges[view];
      if (!panel || !image) return;
      [panel.width, panel.height] = [image.width, image.height];
      const picture = new ImageData(image.width, image.height);
      image.values.forEach((value, i) => picture.data.set([0, 0, 0].map(() => (255 * (value - low)) / (high - low)).concat(255), 4 * i));
      panel.getContext("2d")!.putImageData(picture, 0, 0);
    });
  }

  // Of panels, per CSS pixel: where DRRs have to be rough, panels are drawn more coarsely, too.
  private get density(): number { return Math.min(2, devicePixelRatio) * (this.store.state.rough && this.coarse > 1 ? 0.5 : 1); }

  // Panels that show something else than before. While something moves those out of sight wait.
  private compose_all(): void {
    const { state } = this.store;
    this.panels.forEach((panel, view) => {
      if (!panel || (state.rough && !is_in_sight(panel))) return;
      const look = { view, size_css: this.panel_size(view), density: this.density, image_from_panel: this.image_from_panel(view),
        xray: this.xray_ranges[view], drr: this.drr_ranges[view], lens: state.lens?.view === view ? state.lens.at_css : null };
      const from = [panel, JSON.stringify([look, state.mode, state.share, state.xray_windows[view], state.drr_window]), ...this.engine!.sources(view),
        state.slots, state.landmarks, state.marking, state.polygon, state.masks[view], state.frame, state.object];
      if (this.composed[view]?.every((value, i) => value === from[i])) return;
      this.composed[view] = from;
      this.engine!.compose(look, state, panel);
      draw_marks(this, view, panel);
    });
  }

  private cast_all(halvings: number): void {
    const { store } = this, { object } = store.state, { poses } = store, begin = performance.now();
    this.drawn = { poses, object };
    const drrs = store.scene.views.map((_, view) => this.cast_sum(view, poses, halvings));
    const correlations = this.correlations(drrs, halvings);
    const taken = performance.now() - begin;
    if (halvings === this.coarse) this.adapt(taken);
    if (halvings === 0) this.drr_ranges = drrs.map((drr, view) => (drr.values.some((value) => value > 0) ? range_of(drr.values) : this.drr_ranges[view]));
    clearTimeout(this.rest);
    if (halvings > 0) this.rest = window.setTimeout(() => { if (this.engine && !this.engine.lost && !store.state.nudging) this.cast_all(0); this.compose_if_there(); }, REST_MS);
    store.set({ correlations, rough: halvings > 0 });
  }
  private compose_if_there(): void { if (this.engine && !this.engine.lost) this.compose_all(); }

  // The sum of all objects, which compose() shows from now on.
  private cast_sum(view: number, poses: mat4[], halvings: number): Pixels {
    const drrs = poses.map((pose, object) => {
      const known = this.casts[view][object];
      if (known && known.pose === pose && known.halvings === halvings) return known.drr;
      const drr = this.cast(view, pose, halvings, object);
      this.casts[view][object] = { pose, halvings, drr };
      return drr;
    });
    const sum = sum_of(drrs);
    this.engine!.show(view, sum, drrs[this.store.state.object], 2 ** this.halvings_of(view, halvings));
    return sum;
  }

  private adapt(taken_ms: number): void {
    this.frame_ms = taken_ms;
    if (taken_ms > SLOW_MS && this.coarse < COARSEST) this.coarse += 1;
    else if (taken_ms < FAST_MS && this.coarse > 0) this.coarse -= 1;
  }

  // Views differ in size: none becomes too small to compare.
  private halvings_of(view: number, halvings: number): number {
    const smallest = Math.min(...this.store.scene.views[view].size_px);
    let most = 0;
    while (most < halvings && smallest >> (most + 1) >= SMALLEST_PX) most += 1;
    return most;
  }
  cast(view: number, pose: mat4, halvings: number, object = this.store.state.object): Pixels { return this.engine!.cast(object, view, pose, 2 ** this.halvings_of(view, halvings)); }

  private correlations(drrs: Pixels[], halvings: number): (number | null)[] {
    return drrs.map((drr, view) => { const pyramid = this.pyramids[view]; return pyramid ? correlation(pyramid.at(this.halvings_of(view, halvings)), drr) : null; });
  }

  // With the object chosen at `pose`: mean over the views that have an X-ray; null where none has.
  mean_correlation(pose: mat4, halvings: number): number | null {
    const { poses, state } = this.store, at = poses.map((other, object) => (object === state.object ? pose : other));
    const drrs = this.store.scene.views.map((_, i) => (this.xrays[i] ? this.cast_sum(i, at, halvings) : { width: 0, height: 0, values: new Float32Array() }));
    return mean(this.correlations(drrs, halvings));
  }
}

export function mean(values: (number | null)[]): number | null {
  const known = values.filter((value): value is number => value !== null);
  return known.length ? known.reduce((a, b) => a + b) / known.length : null;
}
