// Landmarks: a list, three slices of the CT to mark them in, and the pose that follows.
import { useEffect, useRef, useState } from "preact/hooks";
import { are_enough, pairs_of, point_of_voxel, pose_by_landmarks, type Landmark } from "./landmarks";
import type { Live } from "./live";
import { download, landmarks_csv, marks_csv } from "./save";
import type { State } from "./state";

type Props = { live: Live; state: State };

// Columns and rows of a slice run along these axes of the volume; the third is the slice's own.
const SLICES = [{ name: "axial", axes: [0, 1, 2] }, { name: "coronal", axes: [0, 2, 1] }, { name: "sagittal", axes: [1, 2, 0] }];

function changed(state: State, index: number, change: Partial<Landmark>): Landmark[] {
  return state.landmarks.map((landmark, i) => (i === index ? { ...landmark, ...change } : landmark));
}

function draw_slice(live: Live, canvas: HTMLCanvasElement, [a, b, c]: number[], cursor: number[]): void {
  const { volume } = live.store, stride = [1, volume.size[0], volume.size[0] * volume.size[1]], width = volume.size[a], height = volume.size[b];
  canvas.width = width;
  canvas.height = height;
  const context = canvas.getContext("2d")!, picture = context.createImageData(width, height);
  for (let y = 0; y < height; y += 1) for (let x = 0; x < width; x += 1) {
    const row = b === 2 ? height - 1 - y : y, value = volume.values[x * stride[a] + row * stride[b] + Math.round(cursor[c]) * stride[c]], i = 4 * (y * width + x);
    const on_cursor = x === Math.round(cursor[a]) || row === Math.round(cursor[b]);
    picture.data.set(on_cursor ? [value / 2 + 90, value / 2 + 80, value / 2, 255] : [1.6 * value, 1.6 * value, 1.6 * value, 255], i);
  }
  context.putImageData(picture, 0, 0);
}

function Slice({ live, axes, name, cursor, on_cursor }: { live: Live; axes: number[]; name: string; cursor: number[]; on_cursor: (cursor: number[]) => void }) {
  const canvas = useRef<HTMLCanvasElement>(null), { volume } = live.store, [a, b, c] = axes;
  useEffect(() => draw_slice(live, canvas.current!, axes, cursor), [cursor, volume]);
  const click = (event: MouseEvent) => {
    const box = canvas.current!.getBoundingClientRect(), next = cursor.slice(), inside = (value: number, axis: number) => Math.min(volume.size[axis] - 1, Math.max(0, value));
    const row = ((event.clientY - box.top) / box.height) * volume.size[b] - 0.5;
    next[a] = inside(((event.clientX - box.left) / box.width) * volume.size[a] - 0.5, a);
    next[b] = inside(b === 2 ? volume.size[b] - 1 - row : row, b);
    on_cursor(next);
  };
  const scroll = (value: number) => { const next = cursor.slice(); next[c] = value; on_cursor(next); };
  return (
    <figure>
      <canvas ref={canvas} class="slice" onClick={click} role="img" aria-label={`${name} slice of the CT; click to mark`}
        style={`aspect-ratio:${volume.size[a] * volume.spacing_mm[a]} / ${volume.size[b] * volume.spacing_mm[b]}`} />
      <label>{name} <input type="range" min="0" max={volume.size[c] - 1} step="0.5" value={cursor[c]} onInput={(e) => scroll(Number(e.currentTarget.value))} /></label>
    </figure>
  );
}

function Row({ live, state, index }: Props & { index: number }) {
  const { store } = live, landmark = state.landmarks[index], views = store.scene.views.filter((_, i) => landmark.pixels[i]).map((view) => view.name);
  return (
    <li>
      <button type="button" aria-pressed={state.marking === index} onClick={() => store.set({ marking: state.marking === index ? null : index, tool: "move", polygon: null })}>{landmark.name}</button>
      {" "}{landmark.ct_mm ? "in the CT" : "not in the CT yet"}; {views.length ? `in ${views.join(", ")}` : "in no X-ray yet"}{" "}
      <button type="button" aria-label={`remove ${landmark.name}`} onClick={() => store.set({ landmarks: state.landmarks.filter((_, i) => i !== index), marking: null })}>×</button>
    </li>
  );
}

export function Marking({ live, state }: Props) {
  const { store } = live, { scene, volume } = store, [cursor, set_cursor] = useState<number[]>([0, 0, 0]), [said, say] = useState("");
  useEffect(() => set_cursor(volume.size.map((n) => (n - 1) / 2)), [volume]);
  const pairs = pairs_of(scene, state.landmarks);
  const add = () => {
    const number = 1 + Math.max(0, ...state.landmarks.map(({ name }) => Number(name.slice(1))));
    store.set({ landmarks: [...state.landmarks, { name: `P${number}`, ct_mm: null, pixels: scene.views.map(() => null) }], marking: state.landmarks.length, tool: "move", polygon: null });
  };
  const move_cursor = (next: number[]) => {
    set_cursor(next);
    if (state.marking !== null) store.set({ landmarks: changed(state, state.marking, { ct_mm: point_of_voxel(volume, next) }) });
  };
  const solve = () => {
    const { pose, rms_px } = pose_by_landmarks(scene, volume, state.landmarks, store.pose);
    store.move(pose);
    store.set({ marking: null });
    say(`Laid on ${pairs.length} marks; off by ${rms_px.toFixed(2)} pixels (rms).`);
  };
  return (
    <details class="marking" id="landmarks">
      <summary>Landmarks: mark the same points in the X-rays and in the CT, and the pose follows</summary>
      <p class="note">Add a point, click it in an X-ray (yellow lines in the other views show where it must lie there) and in the slices; three points or more. While a point is chosen, clicks mark instead of moving.</p>
      <p><button type="button" id="add-landmark" onClick={add}>Add a point</button>{" "}
        <button type="button" id="pose-by-landmarks" disabled={!are_enough(state.landmarks, pairs)} onClick={solve}>Pose by landmarks</button>{" "}<span role="status">{said}</span></p>
      <ol>{state.landmarks.map((_, index) => <Row key={index} live={live} state={state} index={index} />)}</ol>
      <p class="row"><button type="button" id="save-landmarks" disabled={!state.landmarks.some(({ ct_mm }) => ct_mm)} onClick={() => download("landmarks3d.csv", landmarks_csv(state.landmarks), "text/csv")}>Save landmarks3d.csv</button>
        {scene.views.map((view, i) => <button type="button" id={`save-marks-${i}`} disabled={!marks_csv(state.landmarks, view, i)} onClick={() => download(`landmarks_${view.name}.csv`, marks_csv(state.landmarks, view, i), "text/csv")}>Save landmarks_{view.name}.csv</button>)}</p>
      <div class="slices">{SLICES.map(({ name, axes }) => <Slice key={name} live={live} name={name} axes={axes} cursor={cursor} on_cursor={move_cursor} />)}</div>
    </details>
  );
}
