// One view: its picture, and the hands on it.
import type { mat4 } from "gl-matrix";
import { useEffect, useRef } from "preact/hooks";
import type { Live } from "./live";
import { DEGREES_PER_PIXEL, angle_around_centre_deg, drag_in_plane, move_in_depth, shift_in_plane, turn_in_plane, turn_out_of_plane } from "./moves";
import { brushed, changed, filled, ignored_of } from "./masks";
import type { State } from "./state";

type Action = "move" | "turn" | "tilt" | "pan" | "window" | "paint";
interface Drag { action: Action; begin: mat4; last: number[] }

function action_of(event: PointerEvent): Action | null {
  if (event.button === 1 || (event.button === 0 && event.altKey)) return "pan";
  if (event.button === 2) return event.ctrlKey ? "window" : "tilt";
  if (event.button !== 0) return null;
  if (event.ctrlKey) return "window";
  return event.shiftKey ? "turn" : "move";
}

function pixel_at(live: Live, view: number, [x, y]: number[]): [number, number] {
  const [fx, fy, ox, oy] = live.image_from_panel(view);
  return [fx * x + ox, fy * y + oy];
}

const place_of = (event: MouseEvent): number[] => {
  const box = (event.currentTarget as HTMLElement).getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};

function continue_drag(live: Live, index: number, drag: Drag, to: number[]): void {
  const { store } = live, { scene, state, pose, volume } = store, view = scene.views[index];
  const from_px = pixel_at(live, index, drag.last), to_px = pixel_at(live, index, to);
  const moved_px: [number, number] = [to_px[0] - from_px[0], to_px[1] - from_px[1]];
  const sign = state.mirrored ? -1 : 1, moved = [to[0] - drag.last[0], to[1] - drag.last[1]];
  drag.last = to;
  if (drag.action === "move") store.show(drag_in_plane(pose, view, volume, moved_px));
  if (drag.action === "turn") store.show(turn_in_plane(pose, view, volume, angle_around_centre_deg(pose, view, volume, from_px, to_px)));
  if (drag.action === "tilt") store.show(turn_out_of_plane(pose, view, volume, sign * DEGREES_PER_PIXEL * moved[0], DEGREES_PER_PIXEL * moved[1]));
  if (drag.action === "paint") paint(live, index, from_px, to_px);
  if (drag.action === "pan") pan(live, index, moved_px);
  if (drag.action === "window") change_window(live, index, moved);
}

function pan(live: Live, index: number, [du, dv]: [number, number]): void {
  const { state } = live.store, zoom = live.zoom_of(index, live.panel_size(index));
  const zooms = state.zooms.slice();
  zooms[index] = { ...zoom, centre_px: [zoom.centre_px[0] - du, zoom.centre_px[1] - dv] };
  live.store.set({ zooms });
}

function zoom_by(live: Live, index: number, factor: number, at: number[]): void {
  const zoom = live.zoom_of(index, live.panel_size(index)), [u, v] = pixel_at(live, index, at);
  const zooms = live.store.state.zooms.slice();
  zooms[index] = { px_per_css: zoom.px_per_css * factor, centre_px: [u + (zoom.centre_px[0] - u) * factor, v + (zoom.centre_px[1] - v) * factor] };
  live.store.set({ zooms });
}

// To the right: more contrast; down: brighter.
function change_window(live: Live, index: number, [right, down]: number[]): void {
  const windows = live.store.state.xray_windows.slice(), { low, high } = windows[index];
  const width = Math.min(3, Math.max(0.05, (high - low) * Math.exp(-right / 200))), middle = (low + high) / 2 - down / 400;
  windows[index] = { low: middle - width / 2, high: middle + width / 2 };
  live.store.set({ xray_windows: windows });
}

function mark(live: Live, index: number, number: number, pixel: [number, number]): void {
  const landmarks = live.store.state.landmarks.map((landmark, i) => (i === number ? { ...landmark, pixels: landmark.pixels.map((old, view) => (view === index ? pixel : old)) } : landmark));
  live.store.set({ landmarks });
}

// A stroke of the brush: its first dab begins a mask that undo comes back from, the others go on with it.
function begin_stroke(live: Live, index: number, at_px: number[]): void {
  const { store } = live, { masks } = store.state, ignored = ignored_of(masks[index], store.scene.views[index], live.xrays[index]);
  store.set({ masks: masks.map((mask, i) => (i === index ? changed(mask, ignored) : mask)) });
  paint(live, index, at_px, at_px);
}
function paint(live: Live, index: number, from_px: number[], to_px: number[]): void {
  const { store } = live, { masks, brush_px, erases } = store.state, view = store.scene.views[index];
  const ignored = brushed(masks[index].ignored!, view.size_px, from_px, to_px, brush_px, erases ? 0 : 1);
  store.set({ masks: masks.map((mask, i) => (i === index ? { ...mask, ignored } : mask)) });
}

function add_corner(live: Live, index: number, at_px: number[]): void {
  const { polygon } = live.store.state, corners = polygon?.view === index ? polygon.corners : [];
  live.store.set({ polygon: { view: index, corners: [...corners, at_px] } });
}
export function close_polygon(live: Live): void {
  const { store } = live, { polygon, masks, erases } = store.state;
  if (!polygon) return;
  const { view: index, corners } = polygon, view = store.scene.views[index];
  const ignored = filled(ignored_of(masks[index], view, live.xrays[index]), view.size_px, corners, erases ? 0 : 1);
  store.set({ polygon: null, masks: corners.length < 3 ? masks : masks.map((mask, i) => (i === index ? changed(mask, ignored) : mask)) });
}

const KEY_HELP = "arrows move in the view's plane, Page Up and Page Down in depth; with Shift arrows turn; comma and full stop turn about the view's axis";

// A pose for a key, or null where the key means nothing.
function pose_of_key(live: Live, index: number, event: KeyboardEvent): mat4 | null {
  const { scene, state, pose, volume } = live.store, view = scene.views[index], step = state.step, sign = state.mirrored ? -1 : 1;
  const arrows: Record<string, [number, number]> = { ArrowLeft: [-sign, 0], ArrowRight: [sign, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  const arrow = arrows[event.key];
  if (arrow && event.shiftKey) return turn_out_of_plane(pose, view, volume, step * arrow[0], step * arrow[1]);
  if (arrow) return shift_in_plane(pose, view, step * arrow[0], step * arrow[1]);
  if (event.key === "PageUp") return move_in_depth(pose, view, volume, step);
  if (event.key === "PageDown") return move_in_depth(pose, view, volume, -step);
  if (event.key === ".") return turn_in_plane(pose, view, volume, sign * step);
  if (event.key === ",") return turn_in_plane(pose, view, volume, -sign * step);
  return null;
}

function on_wheel(live: Live, index: number, event: WheelEvent): void {
  event.preventDefault();
  const notches = Math.sign(event.deltaY), { scene, state, pose, volume } = live.store;
  if (event.ctrlKey) zoom_by(live, index, 1.15 ** notches, place_of(event));
  else live.store.move(move_in_depth(pose, scene.views[index], volume, notches * state.step));
}

function use_wheel(live: Live, index: number, canvas: { current: HTMLCanvasElement | null }): void {
  useEffect(() => {
    const node = canvas.current!, listener = (event: WheelEvent) => on_wheel(live, index, event);
    live.panels[index] = node;
    node.addEventListener("wheel", listener, { passive: false });  // the page must not scroll under it
    const observer = new ResizeObserver(() => live.ask());
    observer.observe(node);
    live.ask();
    return () => { node.removeEventListener("wheel", listener); observer.disconnect(); live.panels[index] = null; };
  }, []);
}

function correlation_text(state: State, index: number): string {
  const value = state.correlations[index];
  if (state.trouble) return "";
  return value === null ? "no X-ray: nothing to compare" : `gradient correlation ${state.rough ? "≈ " : ""}${value.toFixed(3)}`;
}

export function Panel({ live, index, state }: { live: Live; index: number; state: State }) {
  const canvas = useRef<HTMLCanvasElement>(null), drag = useRef<Drag | null>(null);
  const { store } = live, view = store.scene.views[index];
  use_wheel(live, index, canvas);
  const down = (event: PointerEvent): void => {
    const action = action_of(event);
    canvas.current!.focus();
    store.set({ active: index });
    if (!action || state.nudging) return;
    event.preventDefault();
    const here_px = pixel_at(live, index, place_of(event)), paints = action === "move" && state.tool === "brush";
    if (action === "move" && state.marking !== null) return mark(live, index, state.marking, here_px);
    if (action === "move" && state.tool === "polygon") return add_corner(live, index, here_px);
    if (paints) begin_stroke(live, index, here_px);
    canvas.current!.setPointerCapture(event.pointerId);
    drag.current = { action: paints ? "paint" : action, begin: store.pose, last: place_of(event) };
  };
  const move = (event: PointerEvent) => {
    if (store.state.has_lens) store.set({ lens: { view: index, at_css: place_of(event) } });
    if (drag.current) continue_drag(live, index, drag.current, place_of(event));
  };
  const up = () => {
    const ended = drag.current;
    drag.current = null;
    if (ended && ended.begin !== store.pose) store.move(store.pose, ended.begin);
  };
  const key = (event: KeyboardEvent) => {
    if (state.polygon && event.key === "Enter") close_polygon(live);
    if (state.polygon && event.key === "Escape") store.set({ polygon: null });
    const pose = state.nudging || event.ctrlKey || event.metaKey || event.altKey ? null : pose_of_key(live, index, event);
    if (!pose) return;
    event.preventDefault();
    store.move(pose);
  };
  return (
    <figure class={"panel" + (state.active === index ? " active" : "")} style={`max-width:max(240px, ${(84 * view.size_px[0]) / view.size_px[1]}vh)`}>
      <figcaption><b>{view.name}</b><span class="value" data-view={index}>{correlation_text(state, index)}</span></figcaption>
      <canvas ref={canvas} tabIndex={0} role="application" style={`aspect-ratio:${view.size_px[0]} / ${view.size_px[1]}`}
        aria-label={`View ${view.name}: X-ray with the live DRR over it. Keys: ${KEY_HELP}`}
        onPointerDown={down} onPointerMove={move} onPointerUp={up} onPointerCancel={up} onKeyDown={key}
        onDblClick={() => close_polygon(live)} onPointerLeave={() => { if (state.lens) store.set({ lens: null }); }}
        onFocus={() => store.set({ active: index })} onContextMenu={(event) => event.preventDefault()} />
    </figure>
  );
}
