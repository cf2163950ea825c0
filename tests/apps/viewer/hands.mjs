// Every hand on the object moves it as worked out here by hand, in a view with skew and an off-centre principal point.
import { POSES, make_case, page_data, write_pose } from "./case.mjs";
import { canvas_box, drag, expect, expect_near, finish, launch, open, pose_of, run, set_pose, settled } from "./browser.mjs";
import { about, apply, euler, farthest, inverse, product, project, rows_of, shift, turn, unproject } from "./linear.mjs";

const CLOSE_MM = 1e-6;
make_case();
write_pose("start.json", POSES[1]);
run(["place", "-v", "ct.mha", "--attenuation", "--views", "xrays/views.json", "--start", "start.json", "-o", "place.html", "--quiet"]);
const { volume, views } = page_data("place.html"), view = views[0], start = POSES[1], centre_ct = volume.centre_ct_mm;
const centre_in_camera = (pose) => apply(product(view.camera_from_world, pose), centre_ct);
const moved_in_camera = (pose, motion) => product(product(product(inverse(view.camera_from_world), motion), view.camera_from_world), pose);
const unit = (v) => v.map((x) => x / Math.hypot(...v));

const browser = await launch(), tab = await open(browser, "place.html");
const same_pose = async (wanted, what) => { const off = farthest(rows_of(await pose_of(tab)), wanted); expect(off <= CLOSE_MM, `${what}: the pose is ${off} mm off`); };
await same_pose(start, "the start");

const box = await canvas_box(tab, 0), px_per_css = Math.max(view.size_px[0] / box.width, view.size_px[1] / box.height);
const middle = [Math.round(box.x + box.width / 2), Math.round(box.y + box.height / 2)], by = (x, y) => [middle[0] + x, middle[1] + y];
// Pixel of the image below a place of the window: the whole picture is fitted into the panel.
const pixel_below = ([x, y]) => [(view.size_px[0] - 1) / 2 + (x - box.x - box.width / 2) * px_per_css, (view.size_px[1] - 1) / 2 + (y - box.y - box.height / 2) * px_per_css];

async function check_move() {
  await drag(tab, middle, by(37, -22));
  const c = centre_in_camera(start), from = unproject(view, [0, 0], c[2]), to = unproject(view, [37 * px_per_css, -22 * px_per_css], c[2]);
  await same_pose(moved_in_camera(start, shift(to.map((x, i) => x - from[i]))), "drag");
  const before = project(view, c), after = project(view, centre_in_camera(rows_of(await pose_of(tab))));
  expect_near(after[0] - before[0], 37 * px_per_css, 1e-6, "the centre follows the pointer along columns");
  expect_near(after[1] - before[1], -22 * px_per_css, 1e-6, "the centre follows the pointer along rows");
}
async function check_wheel() {
  await set_pose(tab, start);
  await tab.mouse.move(...middle);
  await tab.mouse.wheel({ deltaY: 100 });
  await tab.mouse.wheel({ deltaY: 100 });
  await settled(tab);
  const ray = unit(centre_in_camera(start));
  await same_pose(moved_in_camera(start, shift(ray.map((x) => 2 * x))), "two notches of the wheel");
}
async function check_turns() {
  await set_pose(tab, start);
  const c = centre_in_camera(start), [u, v] = project(view, c), from = by(60, 10), to = by(20, 70);
  await drag(tab, from, to, { key: "Shift" });
  const angle_at = (place) => { const [pu, pv] = pixel_below(place); return Math.atan2(pv - v, pu - u); };
  await same_pose(moved_in_camera(start, about(c, turn(unit(c), angle_at(to) - angle_at(from)))), "shift-drag");
  await set_pose(tab, start);
  await drag(tab, middle, by(40, 0), { button: "right" });
  await same_pose(moved_in_camera(start, about(c, turn([0, 1, 0], -40 * 0.25 * Math.PI / 180))), "right-drag to the right");
  await set_pose(tab, start);
  await drag(tab, middle, by(0, 24), { button: "right" });
  await same_pose(moved_in_camera(start, about(c, turn([1, 0, 0], 24 * 0.25 * Math.PI / 180))), "right-drag down");
  // What faces the source follows the pointer: down is towards larger rows.
  const front = [c[0], c[1], c[2] - 10], seen = apply(about(c, turn([1, 0, 0], 0.1)), front);
  expect(project(view, seen)[1] > project(view, front)[1], "the side towards the source moves down");
}
async function check_keys() {
  await set_pose(tab, start);
  await tab.focus(".panel canvas");
  await tab.select("#step", "10");
  await tab.focus(".panel canvas");
  for (const key of ["ArrowRight", "ArrowDown"]) await tab.keyboard.press(key);
  await same_pose(moved_in_camera(start, shift([10, 10, 0])), "arrows in steps of 10 mm");
  await tab.keyboard.press("PageDown");
  const c = centre_in_camera(moved_in_camera(start, shift([10, 10, 0])));
  await same_pose(moved_in_camera(start, shift([10, 10, 0].map((x, i) => x - 10 * unit(c)[i]))), "Page Down comes nearer by 10 mm");
  await set_pose(tab, start);
  await tab.select("#step", "0.1");
  await tab.focus(".panel canvas");
  await tab.keyboard.press(".");
  const c0 = centre_in_camera(start);
  await same_pose(moved_in_camera(start, about(c0, turn(unit(c0), 0.1 * Math.PI / 180))), "full stop turns by 0.1 degrees");
}
async function type_in(id, value) {
  await tab.focus(id);
  await tab.$eval(id, (node) => { node.value = ""; });
  await tab.type(id, String(value));
  await tab.keyboard.press("Tab");
  await settled(tab);
}
async function check_numbers() {
  await set_pose(tab, start);
  for (const [axis, value] of [["x", 1.5], ["y", -20], ["z", 33.25]]) await type_in(`#position-${axis}`, value);
  for (const [axis, value] of [["x", 10], ["y", -35], ["z", 120]]) await type_in(`#angle-${axis}`, value);
  const turned = euler(10 * Math.PI / 180, -35 * Math.PI / 180, 120 * Math.PI / 180), c = apply(turned, centre_ct);
  const wanted = product(shift([1.5, -20, 33.25].map((x, i) => x - c[i])), turned);
  const off = farthest(rows_of(await pose_of(tab)), wanted);
  expect(off < 1e-6, `typed numbers: the pose is ${off} mm off`);
  const before = await pose_of(tab);
  await type_in("#angle-x", "");
  expect(String(before) === String(await pose_of(tab)), "an emptied number changes nothing");
}
async function check_history() {
  await set_pose(tab, start);
  await tab.evaluate(() => scrollTo(0, 0));  // focus on a number has moved the page
  await drag(tab, middle, by(25, 5));
  const moved = rows_of(await pose_of(tab));
  await tab.keyboard.down("Control");
  await tab.keyboard.press("z");
  await tab.keyboard.up("Control");
  await same_pose(start, "undo takes a whole drag back");
  await tab.click("#redo");
  await same_pose(moved, "redo");
  await tab.click("#undo");
  await tab.click("#restart");
  await same_pose(start, "as at the start");
}
async function check_presets() {
  const axes = { AP: [[1, 0, 0], [0, 0, -1], [0, 1, 0]], PA: [[-1, 0, 0], [0, 0, -1], [0, -1, 0]],
    "lateral from the left": [[0, 1, 0], [0, 0, -1], [-1, 0, 0]], "lateral from the right": [[0, -1, 0], [0, 0, -1], [1, 0, 0]] };
  await tab.focus(".panel canvas");
  for (const [name, wanted] of Object.entries(axes)) {
    await tab.select("#preset", name);
    await settled(tab);
    const shown = product(view.camera_from_world, rows_of(await pose_of(tab))).slice(0, 3).map((row) => row.slice(0, 3));
    expect(farthest(shown, wanted) < 1e-9, `${name}: columns, rows and depth of the view run along ${JSON.stringify(shown)}`);
  }
  const place = apply(rows_of(await pose_of(tab)), centre_ct), stays = apply(start, centre_ct);
  expect(Math.hypot(...place.map((x, i) => x - stays[i])) < 1e-6, "presets leave the object's centre where it is");
  await tab.select("#preset", "as in the CT");
  expect(farthest(rows_of(await pose_of(tab)).slice(0, 3).map((row) => row.slice(0, 3)), [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) < 1e-12, "as in the CT");
}
async function check_mirrored_and_zoomed() {
  await set_pose(tab, start);
  await tab.click("#mirror");
  const before = project(view, centre_in_camera(start));
  const there = await canvas_box(tab, 0), at = [Math.round(there.x + there.width / 2), Math.round(there.y + there.height / 2)];
  await drag(tab, at, [at[0] + 20, at[1]]);
  const after = project(view, centre_in_camera(rows_of(await pose_of(tab))));
  expect_near(after[0] - before[0], -20 * px_per_css, 1e-6, "mirrored, the object still follows the pointer");
  await tab.click("#mirror");
  await set_pose(tab, start);
  await tab.click("#zoom");
  const zoom = await tab.evaluate(() => raylign.store.state.zooms[0]);
  const c = project(view, centre_in_camera(start));
  expect(Math.abs(zoom.centre_px[0] - c[0]) < 40 && Math.abs(zoom.centre_px[1] - c[1]) < 40 && zoom.px_per_css < px_per_css, `the object is in the middle: ${zoom.centre_px}, ${c}`);
  await drag(tab, at, [at[0] + 20, at[1]]);
  const zoomed = project(view, centre_in_camera(rows_of(await pose_of(tab))));
  expect_near(zoomed[0] - c[0], 20 * zoom.px_per_css, 1e-6, "zoomed, the object still follows the pointer");
  await tab.click("#whole");
}
async function check_nudge() {
  await set_pose(tab, product(shift([1.5, -1, 1]), POSES[0]));
  const worth = () => tab.evaluate(() => raylign.mean_correlation(raylign.store.pose, 0));
  const before = await worth();
  await tab.click("#nudge");
  await tab.waitForFunction(() => !raylign.store.state.nudging, { timeout: 240000 });
  await settled(tab);
  const after = await worth(), far = (pose) => Math.hypot(...apply(pose, centre_ct).map((x, i) => x - apply(POSES[0], centre_ct)[i]));
  expect(after > before, `nudge raises the correlation: ${before}, ${after}`);
  expect(far(rows_of(await pose_of(tab))) < 0.5 * Math.hypot(1.5, 1, 1), `nudge comes nearer to the truth: ${far(rows_of(await pose_of(tab)))} mm`);
  await tab.click("#undo");
  await same_pose(product(shift([1.5, -1, 1]), POSES[0]), "one undo takes a nudge back");
}

for (const check of [check_move, check_wheel, check_turns, check_keys, check_numbers, check_history, check_presets, check_mirrored_and_zoomed, check_nudge]) await check();
const command = await tab.$eval("#command", (node) => node.textContent);
expect(command === "raylign register --volume ct.mha --attenuation --views xrays/views.json --start start.json -o result", `the command to go on: ${command}`);
await browser.close();
finish("every hand moves the object as worked out");
