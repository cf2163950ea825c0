// Keeps what is shown up to date with the state: rough DRRs while something moves, full ones when it rests.
import type { mat4 } from "gl-matrix";
import { Pyramid, correlation } from "./correlation";
import type { Pixels } from "./data";
import { Engine, type Range } from "./engine";
import { draw_marks } from "./marks";
import { fit, image_from_panel, type Store, type Zoom } from "./state";

const SLOW_MS = 90, FAST_MS = 25, REST_MS = 180, COARSEST = 3, SMALLEST_PX = 48;

// The 1st to the 99.5th percentile of what is not 0: a few hot pixels do not spoil the contrast.
export function range_of(values: Float32Array): Range {
  const sorted = values.filter((value) => value !== 0 && Number.isFinite(value)).sort();
  if (!sorted.length) return { low: 0, high: 1 };
  const low = sorted[Math.floor(0.01 * (sorted.length - 1))], high = sorted[Math.floor(0.995 * (sorted.length - 1))];
  return { low, high: high > low ? high : low + 1 };
}

export class Live {
  engine: Engine | null = null;
  readonly panels: (HTMLCanvasElement | null)[];
  private pyramids: (Pyramid | null)[];
  private xray_ranges: Range[];
  private drr_ranges: Range[];
  private drawn_pose: mat4 | null = null;
  private coarse = 0;             // halvings while something moves
  private asked = false;
  private rest = 0;
  frame_ms = 0;                   // the last rough one

  constructor(readonly store: Store) {
    const { views } = store.scene;
    this.panels = views.map(() => null);
    this.pyramids = views.map((view) => (view.image ? new Pyramid(view) : null));
    this.xray_ranges = views.map((view) => (view.image ? range_of(view.image.values) : { low: 0, high: 1 }));
    this.drr_ranges = views.map(() => ({ low: 0, high: 1 }));
    this.start();
    store.listen(() => this.ask());
  }

  private start(): void {
    try {
      this.engine = new Engine(this.store.scene, () => this.store.set({ trouble: "the browser has taken the graphics away for now (WebGL context lost); it gives them back by itself" }),
        (trouble) => { this.drawn_pose = null; this.store.set({ trouble }); });
    } catch (error) {
      this.store.set({ trouble: (error as Error).message });
    }
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

  private draw(): void {
    if (!this.engine) this.draw_xrays();
    if (!this.engine || this.engine.lost) return;
    if (this.store.state.pose !== this.drawn_pose) this.cast_all(this.coarse);
    this.compose_all();
  }

  // Without WebGL there are at least the X-rays.
  private draw_xrays(): void {
    this.panels.forEach((panel, view) => {
      const { image } = this.store.scene.views[view], { low, high } = this.xray_ranges[view];
      if (!panel || !image) return;
      [panel.width, panel.height] = [image.width, image.height];
      const picture = new ImageData(image.width, image.height);
      image.values.forEach((value, i) => picture.data.set([0, 0, 0].map(() => (255 * (value - low)) / (high - low)).concat(255), 4 * i));
      panel.getContext("2d")!.putImageData(picture, 0, 0);
    });
  }

  private compose_all(): void {
    this.panels.forEach((panel, view) => {
      if (!panel) return;
      this.engine!.compose({ view, size_css: this.panel_size(view), density: Math.min(2, devicePixelRatio), image_from_panel: this.image_from_panel(view),
        xray: this.xray_ranges[view], drr: this.drr_ranges[view] }, this.store.state, panel);
      draw_marks(this, view, panel);
    });
  }

  private cast_all(halvings: number): void {
    const { pose } = this.store.state, begin = performance.now();
    this.drawn_pose = pose;
    const drrs = this.store.scene.views.map((_, view) => this.cast(view, pose, halvings));
    const correlations = this.correlations(drrs, halvings);
    const taken = performance.now() - begin;
    if (halvings === this.coarse) this.adapt(taken);
    if (halvings === 0) this.drr_ranges = drrs.map((drr, view) => (drr.values.some((value) => value > 0) ? range_of(drr.values) : this.drr_ranges[view]));
    clearTimeout(this.rest);
    if (halvings > 0) this.rest = window.setTimeout(() => { if (this.engine && !this.engine.lost && !this.store.state.nudging) this.cast_all(0); this.compose_if_there(); }, REST_MS);
    this.store.set({ correlations, rough: halvings > 0 });
  }
  private compose_if_there(): void { if (this.engine && !this.engine.lost) this.compose_all(); }

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
  cast(view: number, pose: mat4, halvings: number): Pixels { return this.engine!.cast(view, pose, 2 ** this.halvings_of(view, halvings)); }

  private correlations(drrs: Pixels[], halvings: number): (number | null)[] {
    return drrs.map((drr, view) => { const pyramid = this.pyramids[view]; return pyramid ? correlation(pyramid.at(this.halvings_of(view, halvings)), drr) : null; });
  }

  // Mean over the views that have an X-ray; null where none has.
  mean_correlation(pose: mat4, halvings: number): number | null {
    const drrs = this.store.scene.views.map((view, i) => (view.image ? this.cast(i, pose, halvings) : { width: 0, height: 0, values: new Float32Array() }));
    return mean(this.correlations(drrs, halvings));
  }
}

export function mean(values: (number | null)[]): number | null {
  const known = values.filter((value): value is number => value !== null);
  return known.length ? known.reduce((a, b) => a + b) / known.length : null;
}
