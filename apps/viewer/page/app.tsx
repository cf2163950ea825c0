// The page: tools above, views in the middle, numbers and what to do next below.
import { useEffect, useState } from "preact/hooks";
import { numbers_of, pose_of_numbers, preset_pose, PRESETS, type PoseNumbers } from "./geometry";
import { mean, type Live } from "./live";
import { Marking } from "./marking";
import { nudge } from "./nudge";
import { Panel } from "./panel";
import { copy_text, download, pose_json } from "./save";
import { MODES, zoom_to_object, type Mode, type State } from "./state";

type Props = { live: Live; state: State };

const MODE_HELP: Record<Mode, string> = {
  blend: "X-ray grey, DRR amber", checkerboard: "squares of both", curtain: "left the X-ray, right the DRR", edges: "the DRR's edges over the X-ray", difference: "grey where both agree",
};

function Look({ live, state }: Props) {
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
    </fieldset>
  );
}

function Place({ live, state }: Props) {
  const { store } = live, { scene } = store, view = scene.views[state.active];
  const preset = (name: string) => store.move(preset_pose(state.pose, view, name, scene.volume));
  return (
    <fieldset disabled={state.nudging}>
      <legend>Place</legend>
      <button type="button" id="undo" disabled={!state.past.length} onClick={() => store.undo()}>Undo</button>
      <button type="button" id="redo" disabled={!state.future.length} onClick={() => store.redo()}>Redo</button>
      <button type="button" id="restart" onClick={() => store.move(scene.start)}>As at the start</button>
      <label>Turn so that {view.name} shows <select id="preset" value="" onChange={(e) => { const name = e.currentTarget.value; e.currentTarget.value = ""; if (name) preset(name); }}>
        <option value="">choose …</option>{[...Object.keys(PRESETS), "as in the CT"].map((name) => <option value={name}>{name}</option>)}</select></label>
      <label>Step <select id="step" value={String(state.step)} onChange={(e) => store.set({ step: Number(e.currentTarget.value) })}>
        {["0.1", "1", "10"].map((step) => <option value={step}>{step} mm or °</option>)}</select></label>
      <button type="button" id="nudge" disabled={Boolean(state.trouble) || mean(state.correlations) === null} onClick={() => nudge(live)}>{state.nudging ? "Nudging …" : "Nudge"}</button>
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

function Numbers({ live, state }: Props) {
  const { store } = live, { volume } = store.scene, numbers = numbers_of(state.pose, volume);
  const change = (key: keyof PoseNumbers, axis: number) => (value: number) => {
    const list = numbers[key].slice() as PoseNumbers["position_mm"];
    list[axis] = value;
    store.move(pose_of_numbers({ ...numbers, [key]: list }, volume));
  };
  return (
    <fieldset disabled={state.nudging}>
      <legend>The object's centre in the world, and its turns about x, y and z</legend>
      {["x", "y", "z"].map((axis, i) => <NumberField label={axis} name={`position-${axis}`} value={numbers.position_mm[i]} unit="mm" on_change={change("position_mm", i)} />)}
      {["x", "y", "z"].map((axis, i) => <NumberField label={`about ${axis}`} name={`angle-${axis}`} value={numbers.angles_deg[i]} unit="°" on_change={change("angles_deg", i)} />)}
    </fieldset>
  );
}

function Next({ live, state }: Props) {
  const { scene } = live.store;
  const [said, say] = useState("");
  return (
    <section class="next">
      <h2>Go on</h2>
      <p><button type="button" id="save" class="main" onClick={() => { download("start.json", pose_json(state.pose), "application/json"); say("start.json is in the browser's folder for downloads: move it to the folder below."); }}>Save start.json</button>
        {" "}<span role="status">{said}</span></p>
      <p>Then, in <code>{scene.folder}</code>:</p>
      <pre id="command" tabIndex={0}>{scene.command}</pre>
      <button type="button" onClick={() => copy_text(scene.command).then(() => say("Copied."))}>Copy the command</button>
    </section>
  );
}

function Help({ live }: { live: Live }) {
  const { volume, views, notes } = live.store.scene;
  const halved = views.filter((view) => view.halvings > 0);
  const facts = [`The volume in this page: ${volume.size.join(" × ")} voxels of ${volume.spacing_mm.map((s) => Number(s.toPrecision(3))).join(" × ")} mm in 8 bit, cropped to what is not air` +
    (volume.halvings ? `; it was halved ${volume.halvings === 1 ? "once" : `${volume.halvings} times`} to fit. The program goes on with all of the CT.` : "."),
    ...halved.map((view) => `X-ray ${view.name} was halved ${view.halvings === 1 ? "once" : `${view.halvings} times`} to ${view.size_px.join(" × ")} pixels.`)];
  return (
    <section>
      <h2>How to</h2>
      <dl>
        <dt>drag</dt><dd>moves the object in the view's plane: its centre follows the pointer</dd>
        <dt>wheel</dt><dd>moves it along the view's ray, down is away from the source</dd>
        <dt>Shift + drag</dt><dd>turns it about that ray</dd>
        <dt>right button</dt><dd>turns it about the axes in the plane: the side towards the source follows the pointer</dd>
        <dt>arrows, Page Up, Page Down</dt><dd>move by the step; Shift + arrows, comma and full stop turn by it</dd>
        <dt>Ctrl + drag</dt><dd>contrast (right) and brightness (down) of the X-ray</dd>
        <dt>Ctrl + wheel; Alt or middle button + drag</dt><dd>zoom; move the picture</dd>
        <dt>Ctrl + Z, Ctrl + Y</dt><dd>undo, redo</dd>
        <dt>Nudge</dt><dd>a few steps uphill in gradient correlation (1 = alike, 0 = unrelated)</dd>
      </dl>
      <p class="note">Pictures are what the detector sees from the source{live.store.state.mirrored ? ", shown mirrored" : ""}.</p>
      <ul class="note">{facts.map((fact) => <li>{fact}</li>)}</ul>
      {notes.length > 0 && <details class="note"><summary>What was decided while reading ({notes.length})</summary><ul>{notes.map((note) => <li>{note}</li>)}</ul></details>}
    </section>
  );
}

function use_undo_keys(live: Live): void {
  useEffect(() => {
    const listener = (event: KeyboardEvent) => {
      if (!(event.ctrlKey || event.metaKey) || live.store.state.nudging || (event.target as HTMLElement).matches("input[type=number]")) return;
      const key = event.key.toLowerCase();
      if (key === "z" && !event.shiftKey) live.store.undo();
      else if (key === "y" || key === "z") live.store.redo();
      else return;
      event.preventDefault();
    };
    window.addEventListener("keydown", listener);
    return () => window.removeEventListener("keydown", listener);
  }, []);
}

export function App({ live }: { live: Live }) {
  const [state, show] = useState(live.store.state);
  useEffect(() => live.store.listen((now) => show(now)), []);
  use_undo_keys(live);
  const overall = mean(state.correlations), { scene } = live.store;
  return (
    <>
      <header><h1>Place {scene.volume.name}</h1>
        <p class="value" id="overall">{state.trouble ? "" : overall === null ? "no X-ray to compare with" : `gradient correlation ${state.rough ? "≈ " : ""}${overall.toFixed(3)}, mean of ${state.correlations.filter((c) => c !== null).length} view(s)`}</p></header>
      {state.trouble && <p class="trouble" role="alert">No live DRR: {state.trouble}. Poses can still be typed in, undone and saved.</p>}
      <div class="tools"><Place live={live} state={state} /><Look live={live} state={state} /></div>
      <div class={"panels count-" + Math.min(scene.views.length, 5)}>{scene.views.map((_, index) => <Panel key={index} live={live} index={index} state={state} />)}</div>
      <Numbers live={live} state={state} />
      <Marking live={live} state={state} />
      <div class="columns"><Next live={live} state={state} /><Help live={live} /></div>
    </>
  );
}
