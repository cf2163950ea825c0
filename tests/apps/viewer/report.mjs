// The viewer in report.html and track.html: a result is corrected where it is looked at, and goes back as a start or as key frames.
import { copyFileSync, readFileSync, statSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { make_case, page_data } from "./case.mjs";
import { canvas_box, downloaded, drag, expect, finish, launch, open, run, settled, shots, take_downloads } from "./browser.mjs";
import { apply, farthest, inverse, product, rows_of, shift, unproject } from "./linear.mjs";

const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js"), ct = ["-v", "ct.mha", "--attenuation"];
const poses = async (tab) => (await tab.evaluate(() => raylign.store.poses.map((pose) => Array.from(pose)))).map(rows_of);
const text = (tab, selector) => tab.$eval(`>>> ${selector}`, (node) => node.textContent);
const words = (command, name, path) => command.split(" ").slice(1).map((word) => word.replace(name, path));

async function opened(browser, file) {
  const tab = await open(browser, file, { is_report: true });
  expect(await tab.evaluate(() => globalThis.raylign === undefined), "the viewer is not at work before it is asked for");
  await tab.click("#open-viewer");
  await settled(tab);
  return tab;
}
// Of a drag in the first view: what it does to a pose.
async function dragged(tab, { views: [view] }, object, by) {
  const before = (await poses(tab))[object.index], box = await canvas_box(tab, 0), px_per_css = view.size_px[0] / box.width;
  const middle = [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)];
  await drag(tab, middle, [middle[0] + by[0], middle[1] + by[1]]);
  const depth = apply(product(view.camera_from_world, before), object.centre_ct_mm)[2], from = unproject(view, [0, 0], depth), to = unproject(view, by.map((x) => x * px_per_css), depth);
  return product(product(product(inverse(view.camera_from_world), shift(to.map((x, i) => x - from[i]))), view.camera_from_world), before);
}
async function check_accessible(tab, what) {
  await tab.addScriptTag({ content: readFileSync(axe, "utf8") });
  const { violations } = await tab.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
  for (const v of violations) expect(!["serious", "critical"].includes(v.impact), `${what}: axe ${v.id}: ${v.help}: ${v.nodes.map((n) => n.html.slice(0, 120)).join("; ")}`);
}

async function check_register(browser) {
  const report = JSON.parse(run(["register", ...ct, "--views", "xrays/views.json", "--start", "truth.json", "-o", "result", "--json"], [0, 1]));
  const tab = await opened(browser, "result/report.html"), { viewer } = page_data("result/report.html");
  expect(farthest((await poses(tab))[0], report.world_from_ct) < 1e-9, "the viewer begins at the result");
  const wanted = await dragged(tab, viewer, { index: 0, ...viewer.objects[0] }, [15, -9]);
  expect(farthest((await poses(tab))[0], wanted) < 1e-6, "a drag moves the object");
  await check_accessible(tab, "report.html with its viewer");
  await (await tab.$("#viewer-section")).screenshot({ path: join(shots, "report_viewer.png") });
  const over = await tab.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  expect(over <= 0, `with the viewer the report is ${over} px too wide`);
  await (await tab.$(">>> #save")).click();
  const saved = JSON.parse(await downloaded("downloads/start.json")), command = await text(tab, "#command");
  expect(farthest(saved.world_from_ct, wanted) < 1e-6, "start.json is where it was dragged to");
  expect(command === "raylign register --volume ct.mha --attenuation --views xrays/views.json --start start.json -o result", `the same command again: ${command}`);
  await tab.keyboard.down("Control"); await tab.keyboard.press("z"); await tab.keyboard.up("Control");
  await settled(tab);
  expect(farthest((await poses(tab))[0], report.world_from_ct) < 1e-9, "undo by keys");
  await tab.close();
  const again = JSON.parse(run([...words(command, "start.json", "downloads/start.json"), "--json"], [0, 1]));
  expect(farthest(again.start_world_from_ct, wanted) < 1e-6, "register starts from there");
  const bytes = statSync("result/report.html").size;
  run(["register", ...ct, "--views", "xrays/views.json", "--start", "truth.json", "-o", "without", "--no-viewer", "--quiet"], [0, 1]);
  const plain = await open(browser, "without/report.html", { is_report: true });
  expect(await plain.$("#open-viewer") === null && / place .*--start without\/pose\.json -o without\/place\.html$/.test(await plain.$eval("#place-command", (node) => node.textContent)), "without the viewer the page names the command that makes one");
  await plain.close();
  return `report.html ${bytes} bytes, without its viewer ${statSync("without/report.html").size}`;
}

// Four frames, each the same X-rays; a fifth misses one of its views.
async function check_track(browser) {
  for (const n of [1, 2, 3, 4, 5]) copyFileSync("xrays/drr_first.tif", `first.${n}.tif`);
  for (const n of [1, 2, 3, 4]) copyFileSync("xrays/drr_second.tif", `second.${n}.tif`);
  const track = ["track", ...ct, "--views", "geometry.json", "--frames", "first=first.%d.tif", "--frames", "second=second.%d.tif", "--start", "truth.json", "--recover", "none"];
  const first = JSON.parse(run([...track, "-o", "track", "--json"], [0, 1])), tab = await opened(browser, "track/track.html"), { viewer } = page_data("track/track.html");
  expect(viewer.frames.length === 5 && first.frames.done === 5, "every frame is there");
  expect(await tab.$eval(">>> #save", (node) => node.disabled), "nothing moved, nothing to save");
  await tab.evaluate(() => [...document.querySelectorAll("td a")].find((link) => link.textContent === "5").click());
  await tab.waitForFunction(() => raylign.store.state.frame === 4, { timeout: 60000 });
  const found = await tab.evaluate(() => raylign.store.scene.frames.map(({ poses }) => Array.from(poses[0])));
  await tab.$eval(">>> #frame", (node) => { node.value = 2; node.dispatchEvent(new Event("input", { bubbles: true })); });
  await settled(tab);
  expect(await text(tab, "#frame-number") === "3" && farthest((await poses(tab))[0], rows_of(found[2])) === 0, "the slider shows the third frame at its pose");
  const wanted = await dragged(tab, viewer, { index: 0, ...viewer.objects[0] }, [10, 6]);
  await (await tab.$(">>> #next-frame")).click();
  await settled(tab);
  expect(farthest((await poses(tab))[0], rows_of(found[3])) === 0, "other frames stay as they were");
  await (await tab.$(">>> #next-frame")).click();
  await settled(tab);
  expect(/no X-ray/.test(await text(tab, ".panel")) && /missing/.test(await text(tab, ".frames")), "a frame that is missing shows a grid and says so");
  expect(/object in frame 3/.test(await text(tab, ".next")) && await text(tab, "#key-frames button") === "3", "the moved frame is a key frame");
  await (await tab.$("#viewer-section")).screenshot({ path: join(shots, "track_viewer.png") });
  await (await tab.$(">>> #save")).click();
  await downloaded("downloads/keyframes.csv");
  const command = await text(tab, "#command");
  expect(command === "raylign track --volume ct.mha --attenuation --views geometry.json --frames first=first.%d.tif second=second.%d.tif --start truth.json --recover none --keyframe object:3=keyframes.csv -o track", `the same command again: ${command}`);
  await check_accessible(tab, "track.html with its viewer");
  await tab.close();
  const again = JSON.parse(run([...words(command, "=keyframes.csv", "=downloads/keyframes.csv"), "--json"], [0, 1]));
  expect(again.frames.done === 5, "track takes the key frames");
  const { viewer: corrected } = page_data("track/track.html");
  expect(corrected.go_on.key_frames.length === 1 && corrected.go_on.key_frames[0].words === "--keyframe object:3=downloads/keyframes.csv", "the next page knows the key frame, and may replace it");
  const row = readFileSync("downloads/keyframes.csv", "utf8").split("\n")[1].split(",");
  expect(row[1] === "3" && Math.hypot(...[0, 1, 2].map((i) => Number(row[5 + i]) - wanted[i][3])) < 1e-6, "keyframes.csv has where the object was dragged to");
}

make_case();
const browser = await launch();
await take_downloads(browser, "downloads");
const sizes = await check_register(browser);
await check_track(browser);
await browser.close();
finish(`results are corrected where they are looked at; ${sizes}`);
