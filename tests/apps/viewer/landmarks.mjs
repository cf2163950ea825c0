// Points marked by clicks lie where they were clicked, the other view's line goes through the same point, and the pose by landmarks is the
// one by which the points were projected.
import { join } from "node:path";
import { POSES, make_case, page_data, write_pose } from "./case.mjs";
import { canvas_box, expect, expect_near, finish, launch, open, pose_of, run, settled, shots } from "./browser.mjs";
import { apply, euler, farthest, product, project, rows_of, shift } from "./linear.mjs";

make_case();
write_pose("start.json", product(shift([20, -15, 12]), product(POSES[0], euler(0.3, -0.4, 0.5))));
run(["place", "-v", "ct.mha", "--attenuation", "--views", "xrays/views.json", "--start", "start.json", "-o", "place.html", "--quiet"]);
const { volume, views } = page_data("place.html"), truth = POSES[0];
const ct_of = (voxel) => [0, 1, 2].map((r) => volume.origin_mm[r] + voxel.reduce((sum, x, a) => sum + volume.direction[r][a] * volume.spacing_mm[a] * x, 0));
const seen = (view, ct) => project(view, apply(product(view.camera_from_world, truth), ct));
const points = [[5, 6, 4], [25, 8, 15], [12, 22, 10], [30, 25, 3], [3, 20, 18]].map(ct_of);

const browser = await launch(), tab = await open(browser, "place.html");
const state = () => tab.evaluate(() => { const { landmarks, marking } = raylign.store.state; return { landmarks, marking }; });

async function check_clicks() {
  await tab.click("#landmarks summary");
  await tab.click("#add-landmark");
  const before = String(await pose_of(tab)), box = await canvas_box(tab, 0), view = views[0], px_per_css = view.size_px[0] / box.width;
  const place = [Math.round(box.x + 0.4 * box.width), Math.round(box.y + 0.3 * box.height)];
  await tab.mouse.click(...place);
  const { landmarks } = await state(), pixel = landmarks[0].pixels[0];
  expect_near(pixel[0], (place[0] - box.x) * px_per_css - 0.5, 1e-6, "the column clicked");
  expect_near(pixel[1], (place[1] - box.y) * px_per_css - 0.5, 1e-6, "the row clicked");
  expect(before === String(await pose_of(tab)), "a click that marks does not move the object");
  const slice = await (await tab.$$(".slice"))[0], at = await (await slice.scrollIntoView(), slice.boundingBox());
  const [x, y] = [Math.round(at.x + 0.25 * at.width), Math.round(at.y + 0.6 * at.height)];
  await tab.mouse.click(x, y);
  const middle = (volume.size[2] - 1) / 2, wanted = ct_of([((x - at.x) / at.width) * volume.size[0] - 0.5, ((y - at.y) / at.height) * volume.size[1] - 0.5, middle]), marked = (await state()).landmarks[0].ct_mm;
  expect(Math.hypot(...marked.map((x, i) => x - wanted[i])) < 0.1, `the voxel clicked: ${marked}, ${wanted}`);
  await tab.screenshot({ path: join(shots, "landmarks.png"), fullPage: true });
}

// A point that both views show, well inside.
const inside = (view, [u, v]) => u > 8 && v > 8 && u < view.size_px[0] - 9 && v < view.size_px[1] - 9;
const shown = [...Array(volume.size[0] * volume.size[1] * volume.size[2]).keys()]
  .map((i) => ct_of([i % volume.size[0], Math.floor(i / volume.size[0]) % volume.size[1], Math.floor(i / (volume.size[0] * volume.size[1]))]))
  .find((ct) => views.every((view) => inside(view, seen(view, ct))));

// In the second view the yellow line must pass where the truth projects the point that the first view's mark shows.
async function check_epipolar() {
  await tab.evaluate((pixel) => raylign.store.set({ landmarks: [{ name: "P1", ct_mm: null, pixels: [pixel, null] }], marking: 0, share: 0, mode: "blend" }), seen(views[0], shown));
  await settled(tab);
  const [u, v] = seen(views[1], shown), found = await tab.evaluate(([x, y]) => {
    raylign.draw();
    const canvas = document.querySelectorAll(".panel canvas")[1], [fx, fy, ox, oy] = raylign.image_from_panel(1), density = canvas.width / raylign.panel_size(1)[0];
    const column = Math.round(((x - ox) / fx) * density), row = Math.round(((y - oy) / fy) * density), data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    const yellow = (r, c) => { const i = 4 * (r * canvas.width + c); return data[i] > 150 && data[i] - data[i + 2] > 60; };
    let nearest = Infinity, all = 0;
    for (let r = 0; r < canvas.height; r += 1) for (let c = 0; c < canvas.width; c += 1) if (yellow(r, c)) { all += 1; nearest = Math.min(nearest, Math.hypot(r - row, c - column)); }
    return { nearest, all };
  }, [u, v]);
  expect(found.all > 100 && found.nearest < 2, `the epipolar line passes the point: ${JSON.stringify(found)}`);
}

async function check_pose(used_views, count, what) {
  await tab.evaluate((landmarks) => raylign.store.set({ landmarks, marking: null }), points.slice(0, count).map((ct_mm, i) => ({ name: `P${i + 1}`, ct_mm, pixels: views.map((view, v) => (used_views.includes(v) ? seen(view, ct_mm) : null)) })));
  await tab.evaluate(() => raylign.store.move(raylign.store.start));
  await settled(tab);
  await tab.click("#pose-by-landmarks");
  await settled(tab);
  const off = farthest(rows_of(await pose_of(tab)), truth);
  expect(off < 1e-3, `${what}: the pose is ${off} mm off`);
}

await check_clicks();
await check_epipolar();
await check_pose([0, 1], 3, "three points in two views");
await check_pose([0, 1], 5, "five points in two views");
await check_pose([0], 5, "five points in one view");
await tab.evaluate(() => raylign.store.set({ landmarks: raylign.store.state.landmarks.slice(0, 2) }));
expect(await tab.$eval("#pose-by-landmarks", (node) => node.disabled), "two points are too few");
await browser.close();
finish("landmarks give the pose");
