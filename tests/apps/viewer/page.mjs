// The page as such: sizes, every control, a lost context, no WebGL, views without X-rays, sixteen of them, hostile names, axe-core.
import { mkdirSync, readFileSync, renameSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { POSES, make_case, write_json, write_mha } from "./case.mjs";
import { expect, finish, launch, open, pose_of, run, set_pose, settled, shots } from "./browser.mjs";

const axe = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const place = (more, out) => run(["place", "-v", "ct.mha", "--attenuation", "--start", "truth.json", "--quiet", ...more, "-o", out]);

async function check_accessible(tab, what) {
  await tab.addScriptTag({ content: readFileSync(axe, "utf8") });
  const { violations } = await tab.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
  for (const v of violations) expect(!["serious", "critical"].includes(v.impact), `${what}: axe ${v.id}: ${v.help}: ${v.nodes.map((n) => n.html.slice(0, 120)).join("; ")}`);
}

async function check_sizes(browser, file) {
  for (const width of [400, 1280, 1920]) {
    const tab = await open(browser, file, { width, height: 950 });
    const over = await tab.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    expect(over <= 0, `${file} at ${width} px is ${over} px too wide`);
    await tab.screenshot({ path: join(shots, `${file.replace(".html", "")}_${width}.png`), fullPage: true });
    if (width === 1280) await check_accessible(tab, file);
    await tab.close();
  }
}

// Grey values in the middle of the first panel: what is shown, not what is in the state.
const shown = (tab) => tab.evaluate(() => { raylign.draw(); const c = document.querySelector(".panel canvas"); return Array.from(c.getContext("2d").getImageData(0, 0, c.width, c.height).data.filter((_, i) => i % 4 === 0)); });
const differs = (a, b) => a.length !== b.length || a.some((x, i) => Math.abs(x - b[i]) > 8);

async function check_controls(tab) {
  let last = await shown(tab);
  const changes = async (act, what) => { await act(); await settled(tab); const now = await shown(tab); expect(differs(last, now), `${what} changes the picture`); last = now; };
  for (const mode of ["checkerboard", "curtain", "edges", "difference", "blend"]) await changes(() => tab.select("#mode", mode), mode);
  const slide = (id, value) => tab.$eval(id, (node, v) => { node.value = v; node.dispatchEvent(new Event("input", { bubbles: true })); }, value);
  await changes(() => slide("#share", 0.9), "the share");
  await changes(() => slide("#drr-window", 1.7), "the DRR's contrast");
  await changes(() => slide("#drr-level", 0.9), "the DRR's level");
  await changes(() => tab.click("#mirror"), "mirrored");
  await changes(() => tab.click("#zoom"), "zoom to the object");
  await changes(() => tab.click("#whole"), "the whole picture");
  await changes(() => slide("#share", 0), "the X-ray alone");
  const box = await (await tab.$(".panel canvas")).boundingBox();
  await changes(() => slide("#share", 0.9), "the share again");
  await changes(async () => { await tab.click("#lens"); await tab.mouse.move(box.x + box.width / 2, box.y + box.height / 2); }, "the lens around the pointer");
  await changes(() => tab.click("#lens"), "no lens");
  await changes(() => slide("#share", 0), "the X-ray alone again");
  await changes(async () => {
    await tab.keyboard.down("Control");
    await tab.mouse.move(box.x + 60, box.y + 60);
    await tab.mouse.down();
    await tab.mouse.move(box.x + 160, box.y + 90);
    await tab.mouse.up();
    await tab.keyboard.up("Control");
  }, "the X-ray's window");
}

async function check_lost_context(tab) {
  const before = await shown(tab);
  await tab.evaluate(() => { globalThis.loser = raylign.engine.canvas.getContext("webgl2").getExtension("WEBGL_lose_context"); loser.loseContext(); });
  await tab.waitForSelector("[role=alert]", { timeout: 20000 });
  await tab.evaluate(() => loser.restoreContext());
  await tab.waitForFunction(() => !document.querySelector("[role=alert]") , { timeout: 60000 });
  await settled(tab);
  expect(!differs(before, await shown(tab)), "a lost context is restored with the same picture");
}

async function check_without_webgl(browser, file) {
  const tab = await open(browser, file, { prepare: (t) => t.evaluateOnNewDocument(() => {
    const original = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind === "webgl2" ? null : original.call(this, kind, ...more); };
  }) });
  expect(/no WebGL 2/.test(await tab.$eval("[role=alert]", (node) => node.textContent)), "without WebGL 2 the page says so");
  await tab.$eval("#position-x", (node) => { node.value = "12"; node.dispatchEvent(new Event("change", { bubbles: true })); });
  expect(await tab.$eval("#undo", (node) => !node.disabled), "without WebGL 2 numbers can still be typed and undone");
  const grey = await tab.$eval(".panel canvas", (c) => new Set(c.getContext("2d").getImageData(0, 0, c.width, c.height).data.filter((_, i) => i % 4 === 0)).size);
  expect(grey > 20, `without WebGL 2 the X-ray is shown: ${grey} grey values`);
  await tab.screenshot({ path: join(shots, "without_webgl.png"), fullPage: true });
  await tab.close();
}

async function check_without_images(browser) {
  place(["--views", "geometry.json"], "empty.html");
  const tab = await open(browser, "empty.html");
  expect((await tab.$eval(".panel", (node) => node.innerText)).includes("no X-ray"), "a view without an X-ray says so");
  expect(await tab.$eval("#nudge", (node) => node.disabled), "without X-rays there is nothing to nudge towards");
  await tab.$eval("#share", (node) => { node.value = 0; node.dispatchEvent(new Event("input", { bubbles: true })); });
  const grid = new Set(await shown(tab));
  expect(grid.size >= 2, "an empty panel has a grid");
  await check_accessible(tab, "empty.html");
  await tab.screenshot({ path: join(shots, "empty.png"), fullPage: true });
  await tab.close();
}

async function check_sixteen_views(browser) {
  const c_arm = { sad_mm: 700, sdd_mm: 1000, secondary_angle_deg: 0, pixel_pitch_mm: [4, 4], size_px: [64, 64] };
  write_json("sixteen.json", { raylign: 1, views: Array.from({ length: 16 }, (_, i) => ({ name: `v${i}`, c_arm: { ...c_arm, primary_angle_deg: 11 * i } })) });
  place(["--views", "sixteen.json"], "sixteen.html");
  const tab = await open(browser, "sixteen.html");
  expect((await tab.$$(".panel canvas")).length === 16, "sixteen panels");
  await tab.screenshot({ path: join(shots, "sixteen.png"), fullPage: true });
  await tab.close();
}

// Halved until they fit, and said so.
async function check_large(browser) {
  const size = [330, 12, 9];
  write_mha("large.mha", { size, spacing_mm: [0.25, 6, 8], origin_mm: [-40, -30, -30], direction: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }, Array.from({ length: size[0] * size[1] * size[2] }, (_, i) => 0.01 + 0.02 * (i % 7 === 0)));
  write_json("large.json", { raylign: 1, views: [{ name: "AP", c_arm: { sad_mm: 700, sdd_mm: 1000, primary_angle_deg: 0, secondary_angle_deg: 0, pixel_pitch_mm: [0.1, 0.1], size_px: [4000, 4000] } }] });
  run(["place", "-v", "large.mha", "--attenuation", "--views", "large.json", "--quiet", "-o", "large.html"]);
  const tab = await open(browser, "large.html"), text = await tab.$eval("main", (node) => node.innerText);
  expect(/83 × 3 × 3 voxels/.test(text) && /halved 2 times to fit/.test(text), `a large volume is halved and the page says so: ${/The volume in this page.*/.exec(text)?.[0]}`);
  expect(/X-ray AP was halved 3 times to 500 × 500 pixels/.test(text), "a large view is halved, and the page says so");
  await tab.close();
}

async function check_hostile_names(browser) {
  const hostile = "<img src=x onerror=alert(1)>.mha", folder = "</script><script>alert(2)<";
  mkdirSync(folder, { recursive: true });
  renameSync("ct.mha", hostile);
  run(["place", "-v", hostile, "--attenuation", "--views", "xrays/views.json", "--start", "truth.json", "--quiet", "-o", join(folder, "hostile.html")]);
  const tab = await open(browser, join(folder, "hostile.html"));
  expect((await tab.$eval("h1", (node) => node.textContent)).includes(hostile), "a hostile name is shown as it is");
  expect(await tab.$eval("main", (node) => node.querySelectorAll("img, script").length) === 0, "a hostile name makes no element");
  expect((await tab.$eval("#command", (node) => node.textContent)).includes(`'${hostile}'`), "the command quotes a hostile name");
  await tab.close();
}

make_case();
place(["--views", "xrays/views.json"], "place.html");
const browser = await launch();
await check_sizes(browser, "place.html");
const tab = await open(browser, "place.html");
await set_pose(tab, POSES[1]);
await check_controls(tab);
await check_lost_context(tab);
expect((await pose_of(tab)).length === 16, "the pose outlives all of that");
await tab.close();
for (const check of [(b) => check_without_webgl(b, "place.html"), check_without_images, check_sixteen_views, check_large, check_hostile_names]) await check(browser);
await browser.close();
finish("the page holds");
