// What the page hands out, the command to go on with, and how to use it all.
import { useState } from "preact/hooks";
import { command_of, copy_text, download, moved_slots, pose_json, pose_tfm, trajectory_csv } from "./save";
import type { Live } from "./live";
import type { Props } from "./tools";

function save_main({ live }: Props): string {
  const { store } = live, { is_sequence, objects } = store.scene;
  if (is_sequence) {
    download("keyframes.csv", trajectory_csv(store, (frame, object) => store.is_moved(frame, object)), "text/csv");
    return "keyframes.csv";
  }
  if (objects.length > 1) {
    download("start.csv", trajectory_csv(store, () => true), "text/csv");
    return "start.csv";
  }
  download("start.json", pose_json(store.pose), "application/json");
  return "start.json";
}

export function Next({ live, state }: Props) {
  const { store } = live, { scene } = store, [said, say] = useState(""), command = command_of(store);
  const main = scene.is_sequence ? "keyframes.csv" : scene.objects.length > 1 ? "start.csv" : "start.json", moved = moved_slots(store);
  const name = scene.objects.length > 1 || scene.is_sequence ? `start_${scene.objects[state.object].name}` : "start";
  return (
    <section class="next">
      <h2>Go on</h2>
      {scene.is_sequence && <p>{moved.length ? `Moved by hand: ${moved.map(({ object, frame }) => `${object} in frame ${frame}`).join(", ")}. They become key frames.` : "Move an object in a frame: that makes it a key frame, from which the run is corrected both ways."}</p>}
      <p class="row"><button type="button" id="save" class="main" disabled={scene.is_sequence && !moved.length} onClick={() => say(`${save_main({ live, state })} is in the browser's folder for downloads: move it to the folder below.`)}>Save {main}</button>
        {main !== "start.json" && <button type="button" id="save-json" onClick={() => download(`${name}.json`, pose_json(store.pose), "application/json")}>{name}.json</button>}
        <button type="button" id="save-tfm" onClick={() => download(`${name}.tfm`, pose_tfm(store.pose), "text/plain")}>{name}.tfm</button>
        {" "}<span role="status">{said}</span></p>
      <p>Then, in <code>{scene.folder}</code>:</p>
      <pre id="command" tabIndex={0}>{command}</pre>
      <button type="button" onClick={() => copy_text(command).then(() => say("Copied."))}>Copy the command</button>
    </section>
  );
}

function facts_of(live: Live): string[] {
  const { objects, views } = live.store.scene, times = (n: number) => (n === 1 ? "once" : `${n} times`);
  const of = ({ name, volume }: (typeof objects)[number]) => `${objects.length > 1 ? `${name}: ` : "The volume in this page: "}${volume.size.join(" × ")} voxels of ${volume.spacing_mm.map((s) => Number(s.toPrecision(3))).join(" × ")} mm in 8 bit, cropped to what is not air` +
    (volume.halvings ? `; it was halved ${times(volume.halvings)} to fit. The program goes on with all of the CT.` : ".");
  return [...objects.map(of), ...views.filter((view) => view.halvings > 0).map((view) => `X-ray ${view.name} was halved ${times(view.halvings)} to ${view.size_px.join(" × ")} pixels.`)];
}

export function Help({ live }: { live: Live }) {
  const { notes, objects } = live.store.scene;
  return (
    <section>
      <h2>How to</h2>
      <dl>
        <dt>drag</dt><dd>moves {objects.length > 1 ? "the object chosen" : "the object"} in the view's plane: its centre follows the pointer</dd>
        <dt>wheel</dt><dd>moves it along the view's ray, down is away from the source</dd>
        <dt>Shift + drag</dt><dd>turns it about that ray</dd>
        <dt>right button</dt><dd>turns it about the axes in the plane: the side towards the source follows the pointer</dd>
        <dt>arrows, Page Up, Page Down</dt><dd>move by the step; Shift + arrows, comma and full stop turn by it</dd>
        <dt>Ctrl + drag</dt><dd>contrast (right) and brightness (down) of the X-ray</dd>
        <dt>Ctrl + wheel; Alt or middle button + drag</dt><dd>zoom; move the picture</dd>
        <dt>Ctrl + Z, Ctrl + Y</dt><dd>undo, redo{objects.length > 1 ? ", of the object chosen" : ""}</dd>
        <dt>Nudge</dt><dd>a few steps uphill in gradient correlation (1 = alike, 0 = unrelated)</dd>
      </dl>
      <p class="note">Pictures are what the detector sees from the source{live.store.state.mirrored ? ", shown mirrored" : ""}.</p>
      <ul class="note">{facts_of(live).map((fact) => <li>{fact}</li>)}</ul>
      {notes.length > 0 && <details class="note"><summary>What was decided while reading ({notes.length})</summary><ul>{notes.map((note) => <li>{note}</li>)}</ul></details>}
    </section>
  );
}
