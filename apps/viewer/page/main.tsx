/*! gl-matrix, copyright Brandon Jones and Colin MacKenzie IV; Preact, copyright Jason Miller. Licence of both: MIT. */
import { render } from "preact";
import { App } from "./app";
import { read_scene } from "./data";
import { Live } from "./live";
import { Store, first_state } from "./state";

async function begin(): Promise<void> {
  const root = document.getElementById("viewer")!;
  try {
    const scene = await read_scene(JSON.parse(document.getElementById("data")!.textContent!));
    const live = new Live(new Store(scene, first_state(scene)));
    Object.assign(globalThis, { raylign: live });  // for scripts of the reader's own, and for tests
    render(<App live={live} />, root);
  } catch (error) {
    root.textContent = `This page cannot be shown: ${(error as Error).message}`;
  }
}

begin();
