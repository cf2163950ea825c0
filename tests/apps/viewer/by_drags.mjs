// As a user does it: an object off, one drag in each view, start.json saved.
import { statSync } from "node:fs";
import { join } from "node:path";
import { page_data } from "./case.mjs";
import { canvas_box, downloaded, drag, expect, launch, open, run, settled, shots, take_downloads } from "./browser.mjs";
import { apply, product, project, rows_of } from "./linear.mjs";

// Frames a second of the live DRRs while the object moves: as coarse as the page makes them to keep up.
const live_rate = (tab) => tab.evaluate(async () => {
  const { store } = raylign, begin = store.pose, frame = () => new Promise((done) => { requestAnimationFrame(done); });
  const step = async (i) => { const pose = Array.from(begin); pose[12] += 0.2 * (i % 2); store.show(pose); await frame(); };
  for (let i = 0; i < 8; i += 1) await step(i);  // until it has found how coarse to be
  const from = performance.now();
  for (let i = 0; i < 20; i += 1) await step(i);
  const rate = 20000 / (performance.now() - from);
  store.show(begin);
  return rate;
});

// `arguments_`: CT and views for place. From the pose in `off`, the centre is laid where `truth` shows it in each view. Leaves downloads/NAME/start.json and
// pictures; returns the command that the page shows, its words, and figures.
export async function placed_by_drags(name, arguments_, off, truth) {
  const page = `${name}.html`, began = performance.now();
  run(["place", ...arguments_, "--start", off, "-o", page, "--quiet"]);
  const made_s = (performance.now() - began) / 1000, { volume, views } = page_data(page);
  const centre_px = (view, pose) => project(view, apply(product(view.camera_from_world, pose), volume.centre_ct_mm));
  const browser = await launch(), tab = await open(browser, page, { height: 1000 });
  await take_downloads(browser, `downloads/${name}`);
  await tab.screenshot({ path: join(shots, `${name}_before.png`), fullPage: true });
  const correlations = () => tab.evaluate(() => raylign.store.state.correlations), before = await correlations();
  // A hand takes the object by its centre and lays it where the eye sees it.
  for (const [index, view] of views.entries()) {
    const box = await canvas_box(tab, index), px_per_css = view.size_px[0] / box.width;
    const at = ([u, v]) => [Math.round(box.x + (u + 0.5) / px_per_css), Math.round(box.y + (v + 0.5) / px_per_css)];
    await drag(tab, at(centre_px(view, rows_of(await tab.evaluate(() => Array.from(raylign.store.pose))))), at(centre_px(view, truth)));
  }
  const after = await correlations();
  await tab.screenshot({ path: join(shots, `${name}_after.png`), fullPage: true });
  await tab.click("#zoom");
  await tab.select("#mode", "edges");
  await settled(tab);
  await tab.screenshot({ path: join(shots, `${name}_edges.png`), fullPage: true });
  await tab.click("#save");
  const saved = JSON.parse(await downloaded(`downloads/${name}/start.json`));
  expect(saved.raylign === 1 && saved.world_from_ct.length === 4, "start.json is a pose");
  const rate = await live_rate(tab), command = (await tab.$eval("#command", (node) => node.textContent)).split(" ");
  const full_ms = await tab.evaluate(() => { const times = []; for (let i = 0; i < 5; i += 1) { const t = performance.now(); raylign.cast(0, raylign.store.pose, 0); times.push(performance.now() - t); } return times.sort((a, b) => a - b)[2]; });
  await browser.close();
  console.log(`${name}: page ${(statSync(page).size / 1e6).toFixed(1)} MB, made in ${made_s.toFixed(1)} s; volume ${volume.size.join(" x ")}; ${views.length} views of ${views[0].size_px.join(" x ")}: ` +
    `${rate.toFixed(1)} frames a second while it moves, one full DRR ${full_ms.toFixed(0)} ms`);
  return { command: command.slice(1).map((word) => (word === "start.json" ? `downloads/${name}/start.json` : word)), correlations: { before, after }, saved };
}
