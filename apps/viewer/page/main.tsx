/*! gl-matrix, copyright Brandon Jones and Colin MacKenzie IV; Preact, copyright Jason Miller. Licence of both: MIT. */
import { render } from "preact";
import { App } from "./app";
import { read_scene } from "./data";
import { Live } from "./live";
import { Store, first_state } from "./state";

// Draws the viewer of `json` into a node. `is_part`: of another page.
async function mount(node: Element | ShadowRoot, json: unknown, is_part: boolean): Promise<void> {
  const scene = await read_scene(json);
  const live = new Live(new Store(scene, first_state(scene)), await scene.frames[0].xrays());
  Object.assign(globalThis, { raylign: live });  // for scripts of the reader's own, and for tests
  render(<App live={live} root={is_part ? node : window} is_part={is_part} />, node);
}

// In a report the viewer keeps its style to itself, and the page's away.
async function mount_in_report(host: HTMLElement, json: unknown, style: string): Promise<void> {
  const root = host.attachShadow({ mode: "open" }), node = document.createElement("div");
  node.className = "part";
  root.append(Object.assign(document.createElement("style"), { textContent: style }), node);
  await mount(node, json, true);
}

const page = document.getElementById("viewer");
if (page) {
  mount(page, JSON.parse(document.getElementById("data")!.textContent!), false).catch((error: Error) => { page.textContent = `This page cannot be shown: ${error.message}`; });
} else {
  Object.assign(globalThis, { raylign_viewer: mount_in_report });
}
