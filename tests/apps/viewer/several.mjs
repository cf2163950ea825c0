// Several objects in one page: each moves alone, what is shown is their sum, undo is each one's own, and `register` starts from what is saved.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { make_case, page_data, read_tiff, write_pose } from "./case.mjs";
import { canvas_box, downloaded, drag, expect, finish, launch, open, run, settled, shots, take_downloads } from "./browser.mjs";
import { apply, farthest, inverse, product, project, rows_of, shift, unproject } from "./linear.mjs";

make_case();
// Two objects: the case's volume, and the same turned by half a turn about its middle.
const truth = JSON.parse(readFileSync("truth.json", "utf8")).world_from_ct;
run(["phantom", "spine", "--size", "32", "--spacing", "2", "-o", "spine.mha"]);
write_pose("spine.json", product(shift([12, -6, 5]), truth));
const objects = ["--bone", "blobs=ct.mha", "--bone", "spine=spine.mha", "--attenuation"];
run(["place", ...objects, "--views", "xrays/views.json", "--start", "blobs=truth.json", "--start", "spine=spine.json", "-o", "place.html", "--quiet"]);
const scene = page_data("place.html"), view = scene.views[0];

const browser = await launch(), tab = await open(browser, "place.html");
await take_downloads(browser, "downloads");
const poses = async () => (await tab.evaluate(() => raylign.store.poses.map((pose) => Array.from(pose)))).map(rows_of);
const [blobs, spine] = await poses();
expect(farthest(blobs, truth) < 1e-9 && farthest(spine, product(shift([12, -6, 5]), truth)) < 1e-9, "each object begins at its own start");

// What is laid over the X-ray is the sum: more than one object alone shows, by as much as the other shows.
const parts = await tab.evaluate(() => [0, 1].map((object) => Array.from(raylign.cast(0, raylign.store.poses[object], 0, object).values)));
const sum = await tab.evaluate(() => Array.from(raylign.cast_sum(0, raylign.store.poses, 0).values));
expect(parts.every((part) => Math.max(...part) > 0.2), "both objects are seen");
expect(sum.every((value, i) => Math.abs(value - parts[0][i] - parts[1][i]) < 1e-5), "the DRR is the sum of both");

await tab.select("#object", "1");
await settled(tab);
const box = await canvas_box(tab, 0), px_per_css = view.size_px[0] / box.width, middle = [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)];
await drag(tab, middle, [middle[0] + 21, middle[1] - 13]);
const depth = apply(product(view.camera_from_world, spine), scene.objects[1].centre_ct_mm)[2], from = unproject(view, [0, 0], depth), to = unproject(view, [21 * px_per_css, -13 * px_per_css], depth);
const wanted = product(product(product(inverse(view.camera_from_world), shift(to.map((x, i) => x - from[i]))), view.camera_from_world), spine);
let now = await poses();
expect(farthest(now[1], wanted) < 1e-6, "a drag moves the object chosen, true to its own depth");
expect(farthest(now[0], blobs) === 0, "the other object stays");
await tab.screenshot({ path: join(shots, "several.png"), fullPage: true });

await tab.select("#object", "0");
expect(await tab.$eval("#undo", (node) => node.disabled), "undo is each object's own: the first has not moved");
await tab.focus(".panel canvas");
await tab.keyboard.press("ArrowRight");
await tab.select("#object", "1");
await tab.click("#undo");
await settled(tab);
now = await poses();
expect(farthest(now[1], spine) < 1e-9 && farthest(now[0], blobs) > 0.5, "undo takes back the move of the object chosen, not the last one");
await tab.click("#redo");
await settled(tab);

await tab.click("#save");
const csv = String(await downloaded("downloads/start.csv")), command = await tab.$eval("#command", (node) => node.textContent);
expect(csv.trim().split("\n").length === 3, `start.csv has a row for each object: ${csv}`);
expect(command === "raylign register --attenuation --views xrays/views.json --bone blobs=ct.mha spine=spine.mha --start start.csv -o result", `the command to go on: ${command}`);
await tab.click("#save-json");
const one = JSON.parse(await downloaded("downloads/start_spine.json"));
await tab.click("#save-tfm");
await downloaded("downloads/start_spine.tfm");
now = await poses();
await tab.close();
await browser.close();
expect(farthest(one.world_from_ct, now[1]) < 1e-12, "start_spine.json is the pose of the object chosen");
// From start.csv, and from the .tfm: a page of the same objects begins where this one ended.
for (const [starts, what] of [[["--start", "downloads/start.csv"], "start.csv"], [["--start", "blobs=truth.json", "--start", "spine=downloads/start_spine.tfm"], "start_spine.tfm"]]) {
  run(["place", ...objects, "--views", "xrays/views.json", ...starts, "-o", "again.html", "--quiet"]);
  const again = page_data("again.html").frames[0].poses;
  expect(farthest(again[1], now[1]) < 1e-9, `${what} has the pose of spine`);
  if (what === "start.csv") expect(farthest(again[0], now[0]) < 1e-9, "start.csv has the pose of blobs");
}
const words = command.split(" ").slice(1).map((word) => (word === "start.csv" ? "downloads/start.csv" : word));
const report = JSON.parse(run([...words, "--levels", "1", "--max-iterations", "1", "--json"], [0, 1]));
expect(farthest(report.objects[1].start_world_from_ct, now[1]) < 1e-9, "register starts from there");
// Labels of one CT: the command that the page shows names them for register.
finish("several objects move each on its own");
