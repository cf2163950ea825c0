// Brush and polygon, and what is handed out of them and of landmarks: counted in the pixels of the file, which is larger than the page's
// image, turned over and distorted.
import { join } from "node:path";
import { inflateSync } from "node:zlib";
import { make_case, page_data, write_json } from "./case.mjs";
import { canvas_box, downloaded, drag, expect, finish, launch, open, run, settled, shots, take_downloads } from "./browser.mjs";
import { apply, farthest, product, project } from "./linear.mjs";
import { readFileSync } from "node:fs";

make_case();
const first = JSON.parse(readFileSync("geometry.json", "utf8")).views[0], truth = JSON.parse(readFileSync("truth.json", "utf8")).world_from_ct;
const size_px = [1101, 904], intrinsics = first.intrinsics.map((row, r) => (r === 2 ? row : row.map((x) => 8 * x))), distortion = [-0.3, 0.05, 0.002, -0.003];
write_json("big.json", { raylign: 1, views: [{ ...first, name: "big", intrinsics, size_px }] });
run(["drr", "-v", "ct.mha", "--attenuation", "--views", "big.json", "--pose", "truth.json", "-o", "big", "--quiet"]);
const views = (mask) => ({ raylign: 1, views: [{ ...first, name: "big", intrinsics, image: "big/drr_big.tif", flip: "columns", distortion, ...(mask ? { mask } : {}) }].map(({ size_px: _, ...view }) => view) });
write_json("views.json", views());
const place = ["place", "-v", "ct.mha", "--attenuation"];
run([...place, "--views", "views.json", "--start", "truth.json", "-o", "place.html", "--quiet"]);
const { views: [view], volume } = page_data("place.html"), scale = 2 ** view.halvings;
expect(view.halvings === 2, `the image is halved twice: ${view.halvings}`);

// A pixel of the page's image, in the file: worked out here again.
function stored([u, v]) {
  const [[fx, skew, cx], [, fy, cy]] = intrinsics, [px, py] = [u, v].map((x) => scale * x + (scale - 1) / 2);
  const y = (py - cy) / fy, x = (px - cx - skew * y) / fx, r2 = x * x + y * y, [k1, k2, p1, p2] = distortion, f = 1 + k1 * r2 + k2 * r2 * r2;
  const dx = f * x + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), dy = f * y + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  return [size_px[0] - 1 - (fx * dx + skew * dy + cx), fy * dy + cy];
}

// Of an 8-bit grey PNG without filters.
function png_pixels(file) {
  const chunks = {};
  for (let at = 8; at < file.length; at += 12 + file.readUInt32BE(at)) chunks[file.toString("latin1", at + 4, at + 8)] = file.subarray(at + 8, at + 8 + file.readUInt32BE(at));
  const width = chunks.IHDR.readUInt32BE(0), rows = inflateSync(chunks.IDAT);
  return { width, height: chunks.IHDR.readUInt32BE(4), at: ([x, y]) => rows[Math.round(y) * (width + 1) + 1 + Math.round(x)] };
}

const browser = await launch(), tab = await open(browser, "place.html");
await take_downloads(browser, "downloads");
await tab.click("#masks summary");
await tab.select("#tool", "brush");
await tab.$eval("#brush-radius", (node) => { node.value = 10; node.dispatchEvent(new Event("input", { bubbles: true })); });
// Tools below move the page: before each use of the picture it is scrolled back to here.
const box = await canvas_box(tab, 0), px_per_css = view.size_px[0] / box.width;
const pixel_below = ([x, y]) => [(x - box.x) * px_per_css - 0.5, (y - box.y) * px_per_css - 0.5], at = (x, y) => [Math.round(box.x + x * box.width), Math.round(box.y + y * box.height)];
const pose = async () => String(await tab.evaluate(() => Array.from(raylign.store.pose))), correlation = () => tab.evaluate(() => raylign.store.state.correlations[0]);
const ignored = () => tab.evaluate(() => { const { ignored } = raylign.store.state.masks[0]; return ignored ? Array.from(ignored) : null; });
const masked = async ([u, v]) => (await ignored())[Math.round(v) * view.size_px[0] + Math.round(u)] === 1;

const before = await pose(), whole = await correlation(), from = at(0.35, 0.4), to = at(0.6, 0.4), corners = [at(0.1, 0.7), at(0.4, 0.72), at(0.2, 0.95)], inside = at(0.22, 0.78);
await drag(tab, from, to);
expect(before === await pose(), "a brush paints and does not move the object");
expect(whole !== await correlation(), "the correlation heeds the mask");
for (const [place_, what] of [[from, "where the stroke begins"], [at(0.475, 0.4), "between"], [to, "where it ends"]]) expect(await masked(pixel_below(place_)), `painted ${what}`);
const beside = pixel_below(at(0.475, 0.4));
expect(!await masked([beside[0], beside[1] + 12]) && await masked([beside[0], beside[1] + 8]), "the brush is as wide as it says");
await tab.select("#tool", "polygon");
await canvas_box(tab, 0);
for (const corner of corners) await tab.mouse.click(...corner);
expect(!await masked(pixel_below(inside)), "an open polygon fills nothing");
await tab.focus(".panel canvas");
await tab.keyboard.press("Enter");
expect(await masked(pixel_below(inside)) && !await masked(pixel_below(at(0.42, 0.9))), "the polygon fills its inside");
await tab.screenshot({ path: join(shots, "masks.png"), fullPage: true });
await tab.click("#undo-mask");
expect(!await masked(pixel_below(inside)), "undo takes the polygon back");
await tab.click("#erases");
await tab.select("#tool", "brush");
await canvas_box(tab, 0);
await drag(tab, to, to);
expect(!await masked(pixel_below(to)) && await masked(pixel_below(from)), "a brush takes pixels in again");

await tab.click("#save-mask-0");
const png = png_pixels(await downloaded("downloads/mask_big.png")), [u, v] = pixel_below(from);
expect(png.width === size_px[0] && png.height === size_px[1], `the mask has the size of the file: ${png.width} x ${png.height}`);
expect(png.at(stored([u, v])) === 0 && png.at(stored([u, v + 8])) === 0 && png.at(stored([u - 8, v])) === 0, "what is painted is 0 in the file's pixels");
expect(png.at(stored([u, v + 12])) === 255 && png.at(stored([u - 12, v])) === 255, "what is not is 255");

// Landmarks, as if marked without error.
const voxels = [[5, 6, 4], [25, 8, 15], [12, 22, 10], [30, 25, 3], [3, 20, 18]], ct_of = (voxel) => [0, 1, 2].map((r) => volume.origin_mm[r] + voxel.reduce((sum, x, a) => sum + volume.direction[r][a] * volume.spacing_mm[a] * x, 0));
const seen = (ct) => project(view, apply(product(view.camera_from_world, truth), ct));
await tab.click("#landmarks summary");
await tab.evaluate((landmarks) => raylign.store.set({ landmarks }), voxels.map(ct_of).map((ct_mm, i) => ({ name: `P${i}`, ct_mm, pixels: [seen(ct_mm)] })));
await settled(tab);
await tab.click("#save-landmarks");
await downloaded("downloads/landmarks3d.csv");
await tab.click("#save-marks-0");
await downloaded("downloads/landmarks_big.csv");
await tab.close();
await browser.close();

// The program reads both as they were meant.
write_json("masked.json", views("downloads/mask_big.png"));
run([...place, "--views", "masked.json", "--landmarks3d", "downloads/landmarks3d.csv", "--landmarks", "big=downloads/landmarks_big.csv", "-o", "again.html", "--quiet"]);
const again = page_data("again.html"), weights = inflateSync(Buffer.from(again.frames[0].xrays[0].weights, "base64"));
const weight = ([x, y]) => weights[Math.round(y) * view.size_px[0] + Math.round(x)];
expect(weight([u, v]) === 0 && weight([u, v + 8]) === 0 && weight([u, v + 13]) === 255, "the program ignores what was painted, where it was painted");
expect(farthest(again.start, truth) < 0.01, `the pose by the landmarks handed out is the true one: ${farthest(again.start, truth)}`);
finish("masks and landmarks fit the files");
