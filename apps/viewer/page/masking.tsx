// Brush and polygon: what of a view is to be ignored.
import { ignored_of, mask_png, undone } from "./masks";
import { close_polygon } from "./panel";
import { download } from "./save";
import type { Tool } from "./state";
import type { Props } from "./tools";

const TOOLS: Record<Tool, string> = { move: "off", brush: "brush", polygon: "polygon" };

export function Masking({ live, state }: Props) {
  const { store } = live, { views } = store.scene, painted = views.map((_, i) => state.masks[i].past.length > 0);
  const save = async (i: number) => download(`mask_${views[i].name}.png`, await mask_png(views[i], ignored_of(state.masks[i], views[i], live.xrays[i])), "image/png");
  const undo = () => store.set({ masks: state.masks.map((mask, i) => (i === state.active ? undone(mask) : mask)) });
  return (
    <details class="marking" id="masks">
      <summary>Masks: paint what of an X-ray is to be ignored</summary>
      <p class="note">Red pixels do not count. A brush paints while it is dragged; a polygon gets a corner with every click and is closed by a double click or Enter. Correlations heed the masks at once.</p>
      <p class="row"><label>Tool <select id="tool" value={state.tool} onChange={(e) => store.set({ tool: e.currentTarget.value as Tool, polygon: null, marking: null })}>
        {Object.entries(TOOLS).map(([tool, name]) => <option value={tool}>{name}</option>)}</select></label>
        <label>Radius <input id="brush-radius" type="range" min="1" max="60" step="1" value={state.brush_px} onInput={(e) => store.set({ brush_px: Number(e.currentTarget.value) })} /> {state.brush_px} px</label>
        <label><input id="erases" type="checkbox" checked={state.erases} onChange={(e) => store.set({ erases: e.currentTarget.checked })} /> take in again</label>
        <button type="button" id="close-polygon" disabled={!state.polygon} onClick={() => close_polygon(live)}>Close the polygon</button>
        <button type="button" id="undo-mask" disabled={!painted[state.active]} onClick={undo}>Undo in {views[state.active].name}</button></p>
      <p class="row">{views.map((view, i) => <button type="button" id={`save-mask-${i}`} disabled={!painted[i]} onClick={() => save(i)}>Save mask_{view.name}.png</button>)}</p>
      {painted.some(Boolean) && <p>Name them in views.json, each in its view: {views.filter((_, i) => painted[i]).map(({ name }) => <><code>{`"mask": "mask_${name}.png"`}</code> in {name}; </>)}they have the size of the X-rays' files.</p>}
    </details>
  );
}
