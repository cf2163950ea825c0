// A few steps of the page's own descent: tries both ways along each of the six axes, keeps what correlates better, and halves its step.
import type { mat4 } from "gl-matrix";
import type { Live } from "./live";
import { moved_point, product, rigid, shift_by, turn_about, type Vector } from "./geometry";

const FIRST_STEP_MM = 2, LAST_STEP_MM = 0.25, HALVINGS = 2, MOST_ROUNDS = 12;

const axis_vector = (axis: number, length: number): Vector => [0, 1, 2].map((i) => (i === axis ? length : 0)) as Vector;

// Turns move the object's rim by as much as shifts move all of it.
export function neighbours(live: Live, pose: mat4, step_mm: number): mat4[] {
  const { volume } = live.store, centre = moved_point(pose, volume.centre_ct_mm);
  const motions = [0, 1, 2].flatMap((axis) => [-1, 1].flatMap((sign) => [
    shift_by(axis_vector(axis, sign * step_mm)), turn_about(centre, axis_vector(axis, (sign * step_mm) / Math.max(1, volume.radius_mm)))]));
  return motions.map((motion) => rigid(product(motion, pose)));
}

const next_frame = () => new Promise((resolve) => { requestAnimationFrame(resolve); });

export async function nudge(live: Live): Promise<void> {
  const { store } = live, begin = store.pose;
  let pose = begin, best = live.mean_correlation(pose, HALVINGS), step_mm = FIRST_STEP_MM;
  if (best === null) return;
  store.set({ nudging: true });
  for (let round = 0; round < MOST_ROUNDS && step_mm >= LAST_STEP_MM; round += 1) {
    let improved = false;
    for (let i = 0; i < 12; i += 1) {
      const candidate = neighbours(live, pose, step_mm)[i], value = live.mean_correlation(candidate, HALVINGS)!;
      if (!(value > best)) continue;
      [pose, best, improved] = [candidate, value, true];
    }
    if (!improved) step_mm /= 2;
    store.show(pose);
    await next_frame();
    if (live.engine === null || live.engine.lost) break;
  }
  store.set({ nudging: false });
  store.move(pose, begin);
}
