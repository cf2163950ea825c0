// As a user does it, on a real chest CT: an X-ray pair, an object 30 mm off, two drags, start.json saved, `register` from there.
import { existsSync, mkdirSync, readFileSync, statSync } from "node:fs";
import { join, resolve } from "node:path";
import { page_data, write_json, write_pose } from "./case.mjs";
import { canvas_box, data, drag, expect, finish, launch, open, run, settled, shots } from "./browser.mjs";
import { apply, euler, product, project, shift } from "./linear.mjs";

const ct = join(data, "chest/lidc-0314-half.nii.gz");
if (!existsSync(ct)) {
  console.log(`skipped: there is no ${ct}`);
  process.exit(process.env.RAYLIGN_REQUIRE_DATA ? 1 : 77);
}
const c_arm = { sad_mm: 1000, sdd_mm: 1500, secondary_angle_deg: 0, pixel_pitch_mm: [1.9, 1.9], size_px: [256, 256] };
write_json("geometry.json", { raylign: 1, views: [{ name: "AP", c_arm: { ...c_arm, primary_angle_deg: 0 } }, { name: "LAT", c_arm: { ...c_arm, primary_angle_deg: 90 } }] });
const no_start = JSON.parse(run(["geometry", "geometry.json", "--json"]));
expect(no_start !== null, "the geometry is read");
run(["place", "-v", ct, "--views", "geometry.json", "-o", "middle.html", "--quiet"]);
const middle = page_data("middle.html").start;
const truth = product(shift([4, -3, 6]), product(middle, euler(0.03, -0.02, 0.04))), start = product(shift([18, -17, 17]), truth);
write_pose("truth.json", truth);
write_pose("off.json", start);
run(["drr", "-v", ct, "--views", "geometry.json", "--pose", "truth.json", "--noise", "20000", "-o", "xrays", "--quiet"]);
const began = performance.now();
run(["place", "-v", ct, "--views", "xrays/views.json", "--start", "off.json", "-o", "place.html", "--quiet"]);
const made_s = (performance.now() - began) / 1000;
const { volume, views } = page_data("place.html");
const centre_px = (view, pose) => project(view, apply(product(view.camera_from_world, pose), volume.centre_ct_mm));

const browser = await launch(), tab = await open(browser, "place.html", { height: 1000 });
const session = await browser.target().createCDPSession();
mkdirSync("downloads", { recursive: true });
await session.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: resolve("downloads"), eventsEnabled: true });
await tab.screenshot({ path: join(shots, "chest_before.png"), fullPage: true });
const before = await tab.evaluate(() => raylign.store.state.correlations);
// A hand takes the object by its centre and lays it where the eye sees it.
for (const [index, view] of views.entries()) {
  const box = await canvas_box(tab, index), px_per_css = view.size_px[0] / box.width;
  const at = ([u, v]) => [Math.round(box.x + (u + 0.5) / px_per_css), Math.round(box.y + (v + 0.5) / px_per_css)];
  const pose = await tab.evaluate(() => Array.from(raylign.store.state.pose)), rows = [0, 1, 2, 3].map((r) => [0, 1, 2, 3].map((c) => pose[4 * c + r]));
  await drag(tab, at(centre_px(view, rows)), at(centre_px(view, truth)));
}
const after = await tab.evaluate(() => raylign.store.state.correlations);
after.forEach((value, i) => expect(value > before[i] + 0.2, `${views[i].name}: the correlation rises from ${before[i]} to ${value}`));
await tab.screenshot({ path: join(shots, "chest_after.png"), fullPage: true });
await tab.click("#zoom");
await tab.select("#mode", "edges");
await settled(tab);
await tab.screenshot({ path: join(shots, "chest_edges.png"), fullPage: true });
await tab.click("#save");
for (let i = 0; i < 100 && !existsSync("downloads/start.json"); i += 1) await new Promise((done) => { setTimeout(done, 100); });
const frame_ms = await tab.evaluate(() => { const times = []; for (let i = 0; i < 8; i += 1) { const t = performance.now(); raylign.cast(0, raylign.store.state.pose, 0); times.push(performance.now() - t); } return times.sort((a, b) => a - b)[4]; });
const command = (await tab.$eval("#command", (node) => node.textContent)).split(" ");
await browser.close();
const saved = JSON.parse(readFileSync("downloads/start.json", "utf8"));
expect(saved.raylign === 1 && saved.world_from_ct.length === 4, "start.json is a pose");
expect(command.join(" ").endsWith("--views xrays/views.json --start start.json -o result"), `the command goes on from it: ${command.join(" ")}`);
const report = JSON.parse(run(["register", ...command.slice(2).map((word) => (word === "start.json" ? "downloads/start.json" : word)), "--truth", "truth.json", "--json", "--quiet"], [0]));
console.log(`page ${(statSync("place.html").size / 1e6).toFixed(1)} MB, made in ${made_s.toFixed(1)} s; volume ${volume.size.join(" x ")}; one DRR of 256 x 256 with its pixels read: ${frame_ms.toFixed(0)} ms`);
expect(report.verdict.ok, `register believes its result: ${report.verdict.reasons}`);
expect(report.tre.initial_mtre_mm < 6 && report.tre.final_mtre_mm < 0.2, `register ends right: ${JSON.stringify(report.tre)}`);
finish(`from 30 mm by two drags to ${report.tre.initial_mtre_mm.toFixed(2)} mm, by register to ${report.tre.final_mtre_mm.toFixed(3)} mm`);
