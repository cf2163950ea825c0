// The rows of tools above the views, and the numbers below them.
import { numbers_of, pose_of_numbers, preset_pose, PRESETS, type PoseNumbers } from "./geometry";
import { mean, type Live } from "./live";
import { nudge } from "./nudge";
import { MODES, zoom_to_object, type Mode, type State } from "./state";

export type Props = { live: Live; state: State };

const MODE_HELP: Record<Mode, string> = {
  blend: "X-ray grey, DRR amber", checkerboard: "squares of both", curtain: "left the X-ray, right the DRR", edges: "the DRR's edges over the X-ray", difference: "grey where both agree",
};

export function Look({ live, state }: Props) {
  const { store } = live;
  const window_of = (middle: number, width: number) => ({ low: middle - width / 2, high: middle + width / 2 });
  return (
    <fieldset>
      <legend>Look</legend>
      <label>Show <select id="mode" value={state.mode} onChange={(e) => store.set({ mode: e.currentTarget.value as Mode })}>
        {MODES.map((mode) => <option value={mode}>{mode}: {MODE_HELP[mode]}</option>)}</select></label>
      <label>{state.mode === "curtain" ? "Curtain" : "DRR"} <input id="share" type="range" min="0" max="1" step="0.01" value={state.share}
        disabled={state.mode !== "blend" && state.mode !== "curtain"} onInput={(e) => store.set({ share: Number(e.currentTarget.value) })} /></label>
      <label>DRR contrast <input id="drr-window" type="range" min="0.1" max="2" step="0.02" value={2.1 - (state.drr_window.high - state.drr_window.low)}
        onInput={(e) => store.set({ drr_window: window_of((state.drr_window.low + state.drr_window.high) / 2, 2.1 - Number(e.currentTarget.value)) })} /></label>
      <label>DRR level <input id="drr-level" type="range" min="-1" max="2" step="0.02" value={1 - (state.drr_window.low + state.drr_window.high) / 2}
        onInput={(e) => store.set({ drr_window: window_of(1 - Number(e.currentTarget.value), state.drr_window.high - state.drr_window.low) })} /></label>
      <button type="button" id="zoom" onClick={() => store.set({ zooms: store.scene.views.map((view, i) => zoom_to_object(store, view, live.panel_size(i))) })}>Zoom to the object</button>
      <button type="button" id="whole" onClick={() => store.set({ zooms: store.scene.views.map(() => null) })}>Whole picture</button>
      <label title="Pictures are what the detector sees from the source. Mirrored, they are seen from the other side."><input id="mirror" type="checkbox" checked={state.mirrored}
        onChange={(e) => store.set({ mirrored: e.currentTarget.checked })} /> mirrored</label>
      <label title="Around the pointer the X-ray alone, twice as large."><input id="lens" type="checkbox" checked={state.has_lens}
        onChange={(e) => store.set({ has_lens: e.currentTarget.checked, lens: null })} /> lens</label>
    </fieldset>
  );
}

export function Place({ live, state }: Props) {
  const { store } = live, { scene, slot } = store, view = scene.views[state.active];
  const preset = (name: string) => store.move(preset_pose(store.pose, view, name, store.volume));
  return (
    <fieldset disabled={state.nudging}>
      <legend>Place</legend>
      {scene.objects.length > 1 && <label>Object <select id="object" value={String(state.object)} onChange={(e) => store.set({ object: Number(e.currentTarget.value) })}>
        {scene.objects.map(({ name, moves }, i) => <option value={String(i)} disabled={!moves}>{name}{moves ? (store.is_moved(state.frame, i) ? " (moved)" : "") : " (stays)"}</option>)}</select></label>}
      <button type="button" id="undo" disabled={!slot.past.length} onClick={() => store.undo()}>Undo</button>
      <button type="button" id="redo" disabled={!slot.future.length} onClick={() => store.redo()}>Redo</button>
      <button type="button" id="restart" onClick={() => store.move(store.start)}>As at the start</button>
      <label>Turn so that {view.name} shows <select id="preset" value="" onChange={(e) => { const name = e.currentTarget.value; e.currentTarget.value = ""; if (name) preset(name); }}>
        <option value="">choose …</option>{[...Object.keys(PRESETS), "as in the CT"].map((name) => <option value={name}>{name}</option>)}</select></label>
      <label>Step <select id="step" value={String(state.step)} onChange={(e) => store.set({ step: Number(e.currentTarget.value) })}>
        {["0.1", "1", "10"].map((step) => <option value={step}>{step} mm or °</option>)}</select></label>
      <button type="button" id="nudge" disabled={Boolean(state.trouble) || mean(state.correlations) === null} onClick={() => nudge(live)}>{state.nudging ? "Nudging …" : "Nudge"}</button>
    </fieldset>
  );
}

// The frames of a sequence; those that were moved by hand are its new key frames.
export function Frames({ live, state }: Props) {
  const { store } = live, { frames, objects } = store.scene, frame = frames[state.frame];
  const go = (index: number) => { void live.go_to(Math.min(frames.length - 1, Math.max(0, index))); };
  const moved = frames.flatMap(({ number }, f) => (objects.some((_, o) => store.is_moved(f, o)) ? [{ number, f }] : []));
  const status = [...new Set(frame.status)].join(", ");
  return (
    <fieldset disabled={state.nudging} class="frames">
      <legend>Frame</legend>
      <button type="button" id="previous-frame" disabled={state.frame === 0} onClick={() => go(state.frame - 1)} aria-label="previous frame">◀</button>
      <input id="frame" type="range" min="0" max={frames.length - 1} step="1" value={state.frame} aria-label="frame" aria-valuetext={`frame ${frame.number}`} onInput={(e) => go(Number(e.currentTarget.value))} />
      <button type="button" id="next-frame" disabled={state.frame === frames.length - 1} onClick={() => go(state.frame + 1)} aria-label="next frame">▶</button>
      <span class="value">frame <b id="frame-number">{frame.number}</b>{status && ` (${status})`}, {state.frame + 1} of {frames.length} in this page</span>
      {moved.length > 0 && <span id="key-frames">Key frames: {moved.map(({ number, f }) => <button type="button" onClick={() => go(f)}>{number}</button>)}</span>}
    </fieldset>
  );
}

function NumberField({ label, name, value, unit, on_change }: { label: string; name: string; value: number; unit: string; on_change: (value: number) => void }) {
  const commit = (node: HTMLInputElement) => {
    const typed = Number(node.value);
    if (node.value.trim() !== "" && Number.isFinite(typed)) on_change(typed);
    else node.value = value.toFixed(2);
  };
  return <label>{label} <input type="number" step="any" id={name} value={value.toFixed(2)} onChange={(e) => commit(e.currentTarget)} /> {unit}</label>;
}

export function Numbers({ live, state }: Props) {
  const { store } = live, { volume, scene } = store, numbers = numbers_of(store.pose, volume);
  const change = (key: keyof PoseNumbers, axis: number) => (value: number) => {
    const list = numbers[key].slice() as PoseNumbers["position_mm"];
    list[axis] = value;
    store.move(pose_of_numbers({ ...numbers, [key]: list }, volume));
  };
  return (
    <fieldset disabled={state.nudging}>
      <legend>The centre of {scene.objects.length > 1 ? scene.objects[state.object].name : "the object"} in the world, and its turns about x, y and z</legend>
      {["x", "y", "z"].map((axis, i) => <NumberField label={axis} name={`position-${axis}`} value={numbers.position_mm[i]} unit="mm" on_change={change("position_mm", i)} />)}
      {["x", "y", "z"].map((axis, i) => <NumberField label={`about ${axis}`} name={`angle-${axis}`} value={numbers.angles_deg[i]} unit="°" on_change={change("angles_deg", i)} />)}
    </fieldset>
  );
}
