// The page: tools above, views in the middle, numbers and what to do next below.
import { useEffect, useState } from "preact/hooks";
import { Help, Next } from "./going_on";
import { mean, type Live } from "./live";
import { Marking } from "./marking";
import { Masking } from "./masking";
import { Panel } from "./panel";
import { Frames, Look, Numbers, Place } from "./tools";

// `root`: where keys count. In a report the rest of the page has keys of its own.
function use_undo_keys(live: Live, root: EventTarget): void {
  useEffect(() => {
    const listener = (event: Event) => {
      const { ctrlKey, metaKey, shiftKey, key } = event as KeyboardEvent;
      if (!(ctrlKey || metaKey) || live.store.state.nudging || (event.composedPath()[0] as HTMLElement).matches?.("input[type=number]")) return;
      if (key.toLowerCase() === "z" && !shiftKey) live.store.undo();
      else if (key.toLowerCase() === "y" || key.toLowerCase() === "z") live.store.redo();
      else return;
      event.preventDefault();
    };
    root.addEventListener("keydown", listener);
    return () => root.removeEventListener("keydown", listener);
  }, []);
}

export function App({ live, root, is_part }: { live: Live; root: EventTarget; is_part: boolean }) {
  const [state, show] = useState(live.store.state);
  useEffect(() => live.store.listen((now) => show(now)), []);
  use_undo_keys(live, root);
  const overall = mean(state.correlations), { scene } = live.store;
  return (
    <>
      <header>{is_part ? null : <h1>{scene.title}</h1>}
        <p class="value" id="overall">{state.trouble ? "" : overall === null ? "no X-ray to compare with" : `gradient correlation ${state.rough ? "≈ " : ""}${overall.toFixed(3)}, mean of ${state.correlations.filter((c) => c !== null).length} view(s)`}</p></header>
      {state.trouble && <p class="trouble" role="alert">No live DRR: {state.trouble}. Poses can still be typed in, undone and saved.</p>}
      {scene.is_sequence && <Frames live={live} state={state} />}
      <div class="tools"><Place live={live} state={state} /><Look live={live} state={state} /></div>
      <div class={"panels count-" + Math.min(scene.views.length, 5)}>{scene.views.map((_, index) => <Panel key={index} live={live} index={index} state={state} />)}</div>
      <Numbers live={live} state={state} />
      <Marking live={live} state={state} />
      <Masking live={live} state={state} />
      <div class="columns"><Next live={live} state={state} /><Help live={live} /></div>
    </>
  );
}
