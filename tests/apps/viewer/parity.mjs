// The page's DRR is one more engine: its pixels and costs against the reference backend's on the volume that the page carries, for
// three oblique poses and two cameras with skew and off-centre principal points. Then the same with planted faults: all must be seen.
import { readFileSync, writeFileSync } from "node:fs";
import { POSES, embedded_values, make_case, page_data, read_tiff, write_json, write_mha, write_pose } from "./case.mjs";
import { expect, finish, launch, open, run, set_pose } from "./browser.mjs";
import { apply, euler, inverse, product, shift } from "./linear.mjs";

// A texture unit that filters linearly knows 256 places between two texels (OpenGL asks for no more, and SwiftShader and GPUs have no
// more): a weight is off by 1/256 at most. The place itself, a few hundred voxels in float32, is off by 2e-4 voxels at most.
const WEIGHT_ERROR = 1 / 256 + 2e-4;
// Sums of some hundred terms in float32, and of the filter's products.
const RELATIVE_ERROR = 1e-4;

make_case();
run(["place", "-v", "ct.mha", "--attenuation", "--views", "xrays/views.json", "--start", "truth.json", "-o", "place.html", "--quiet"]);
const scene = page_data("place.html"), { volume, views } = scene, values = embedded_values(volume);
const step_mm = Math.min(...volume.spacing_mm) / 2;
write_mha("embedded.mha", volume, values);

const value_at = (x, y, z) => (x >= 0 && y >= 0 && z >= 0 && x < volume.size[0] && y < volume.size[1] && z < volume.size[2]
  ? values[(z * volume.size[1] + y) * volume.size[0] + x] : 0);

// The trilinear value at a place, and the most by which weights that are off change it: per axis the largest difference along it.
function sample(p) {
  const [x, y, z] = p.map(Math.floor), f = [p[0] - x, p[1] - y, p[2] - z];
  const c = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => value_at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2 & 1)));
  let value = 0;
  c.forEach((v, k) => { value += v * (k & 1 ? f[0] : 1 - f[0]) * (k & 2 ? f[1] : 1 - f[1]) * (k & 4 ? f[2] : 1 - f[2]); });
  const slope = [1, 2, 4].reduce((sum, bit) => sum + Math.max(...c.map((v, k) => (k & bit ? Math.abs(v - c[k ^ bit]) : 0))), 0);
  return { value, slope };
}

// Pixel by pixel, by the formula of core/CONVENTIONS.md in double precision: the bound of the page's error.
function bounds(view, pose) {
  const ct_from_camera = inverse(product(view.camera_from_world, pose)), [width, height] = view.size_px, result = [];
  const [[fx, skew, cx], [, fy, cy]] = view.intrinsics_px, source = ct_from_camera.slice(0, 3).map((row) => row[3]);
  const voxel_of = (ct) => [0, 1, 2].map((a) => [0, 1, 2].reduce((sum, r) => sum + volume.direction[r][a] * (ct[r] - volume.origin_mm[r]), 0) / volume.spacing_mm[a]);
  const begin = voxel_of(source);
  for (let v = 0; v < height; v += 1) for (let u = 0; u < width; u += 1) {
    const y = (v - cy) / fy, ray = [(u - cx - skew * y) / fx, y, 1], length = Math.hypot(...ray);
    const end = voxel_of(apply(ct_from_camera, ray.map((x) => x / length))), d = end.map((x, a) => x - begin[a]);
    const near = d.map((x, a) => Math.min((-1 - begin[a]) / x, (volume.size[a] - begin[a]) / x)), far = d.map((x, a) => Math.max((-1 - begin[a]) / x, (volume.size[a] - begin[a]) / x));
    let value = 0, slope = 0;
    for (let k = Math.max(0, Math.floor(Math.max(...near) / step_mm)); (k + 0.5) * step_mm < Math.min(...far); k += 1) {
      const s = sample(begin.map((x, a) => x + (k + 0.5) * step_mm * d[a]));
      value += s.value; slope += s.slope;
    }
    result.push(step_mm * (WEIGHT_ERROR * slope + RELATIVE_ERROR * value) + 1e-6);
  }
  return result;
}

const page_image = (tab, view, pose) => tab.evaluate((v, m) => Array.from(raylign.cast(v, [0, 1, 2, 3].flatMap((c) => [0, 1, 2, 3].map((r) => m[r][c])), 0).values), view, pose);

// The largest error as a share of the bound, and the share of pixels beyond it.
function compare(pixels, reference, allowed) {
  let worst = 0, beyond = 0, error = 0, largest = 0;
  reference.values.forEach((wanted, i) => {
    const off = Math.abs(pixels[i] - wanted);
    worst = Math.max(worst, off / allowed[i]); error = Math.max(error, off); largest = Math.max(largest, wanted);
    if (!(off <= allowed[i])) beyond += 1;
  });
  return { worst, beyond: beyond / reference.values.length, error, largest };
}

const references = POSES.map((pose, i) => {
  write_pose(`pose_${i}.json`, pose);
  run(["drr", "-v", "embedded.mha", "--attenuation", "--views", "geometry.json", "--pose", `pose_${i}.json`, "--backend", "reference", "--projector", "trilinear",
    "--step", String(step_mm), "-o", `reference_${i}`, "--quiet"]);
  return views.map((view) => ({ image: read_tiff(`reference_${i}/drr_${view.name}.tif`), allowed: bounds(view, pose) }));
});

// Away from the pose of the X-rays by ever more.
const COST_POSES = [[[0.02, 0.01, -0.03], [1, -2, 1.5]], [[-0.05, 0.08, 0.04], [-4, 3, 5]], [[0.1, -0.05, 0.12], [3, -4, 2]]]
  .map(([turns, by]) => product(shift(by), product(POSES[0], euler(...turns))));

// Pixels about as large as voxels: where they are much smaller, the program compares coarser images than the page.
function make_cost_case() {
  const { views: fine } = page_data("place.html");
  write_json("coarse.json", { raylign: 1, views: fine.map((view) => ({ name: view.name, size_px: view.size_px.map((n) => n / 2), camera_from_world: view.camera_from_world,
    intrinsics: view.intrinsics_px.map((row, r) => (r === 2 ? row : row.map((x, c) => (c === 2 ? (x - 0.5) / 2 : x / 2)))) })) });
  run(["drr", "-v", "ct.mha", "--attenuation", "--views", "coarse.json", "--pose", "truth.json", "-o", "coarse", "--quiet"]);
  run(["place", "-v", "ct.mha", "--attenuation", "--views", "coarse/views.json", "--start", "truth.json", "-o", "coarse.html", "--quiet"]);
}

// Of the mean over the views, as the program has it before its first step.
function program_cost(pose) {
  write_pose("cost.json", pose);
  const report = JSON.parse(run(["register", "-v", "embedded.mha", "--attenuation", "--views", "coarse/views.json", "--start", "cost.json", "--backend", "reference",
    "--projector", "trilinear", "--step", String(step_mm), "--levels", "1", "--max-iterations", "1", "--content", "whole", "--no-robust", "--search", "none", "-o", "cost", "--json"], [0, 1]));
  expect(report.levels.length === 1 && String(report.levels[0].image_sizes_px) === String(views.map((view) => view.size_px.map((n) => n / 2))), "the program compares the images as they are");
  return report.cost.initial;
}

async function check_images(tab) {
  let worst = 0;
  for (const [i, pose] of POSES.entries()) for (const [v, view] of views.entries()) {
    const { image, allowed } = references[i][v], found = compare(await page_image(tab, v, pose), image, allowed);
    console.log(`pose ${i}, ${view.name}: largest error ${found.error.toExponential(2)} of ${found.largest.toFixed(3)}, ${found.worst.toFixed(2)} of the bound`);
    expect(found.beyond === 0, `pose ${i}, ${view.name}: ${found.beyond} of the pixels are beyond the bound, by up to ${found.worst} times`);
    expect(found.largest > 0.5, `pose ${i}, ${view.name} shows the object`);
    worst = Math.max(worst, found.worst);
  }
  return worst;
}

async function check_costs(tab) {
  for (const pose of COST_POSES) {
    await set_pose(tab, pose);
    const cost = 1 - await tab.evaluate(() => { const c = raylign.store.state.correlations; return c.reduce((a, b) => a + b) / c.length; });
    const wanted = program_cost(pose);
    console.log(`cost ${cost.toFixed(5)}, the program's ${wanted.toFixed(5)}`);
    expect(wanted > 0.01 && wanted < 1, `the pose is off, and not unrelated: ${wanted}`);
    expect(Math.abs(cost - wanted) <= 0.01 * wanted, `cost ${cost}, the program's ${wanted}`);
  }
}

// A page with a fault must be seen in every view: the bound is not so wide as to let it pass.
async function check_planted(browser) {
  const html = readFileSync("place.html", "utf8");
  const swap = (from, to) => { expect(html.includes(from), `the page has ${from}`); return html.replace(from, () => to); };
  const in_data = (change) => { const changed = structuredClone(scene); changed.views.forEach(change); return html.replace(/(id="data">).*(<\/script>)/, (_, a, b) => a + JSON.stringify(changed) + b); };
  const faults = {
    "columns mirrored": swap("vec3(pixel, 1.0)", "vec3(100.0 - pixel.x, pixel.y, 1.0)"),
    "rows mirrored": swap("vec3(pixel, 1.0)", "vec3(pixel.x, 100.0 - pixel.y, 1.0)"),
    "rows for columns": swap("vec3(pixel, 1.0)", "vec3(pixel.yx, 1.0)"),
    "pixels half a pixel off": swap("u_bin - 0.5", "u_bin"),
    "axes of the volume swapped": swap("(voxel + 1.5) * texture_from_voxel", "((voxel + 1.5) * texture_from_voxel).yxz"),
    "volume mirrored": swap("(voxel + 1.5) * texture_from_voxel", "1.0 - (voxel + 1.5) * texture_from_voxel"),
    "volume half a voxel off": swap("(voxel + 1.5)", "(voxel + 1.0)"),
    "leaps too far": swap("(free - 1.0)", "(free + 2.0)"),
    "what there is counts as nothing": swap("free > 0.0 ?", "free >= 0.0 ?"),
    "skew the other way": in_data((view) => { view.intrinsics_px[0][1] *= -1; }),
    "principal point in the middle": in_data((view) => { view.intrinsics_px[0][2] = (view.size_px[0] - 1) / 2; view.intrinsics_px[1][2] = (view.size_px[1] - 1) / 2; }),
    "world for camera": in_data((view) => { view.camera_from_world = inverse(view.camera_from_world); }),
  };
  for (const [name, text] of Object.entries(faults)) {
    writeFileSync("fault.html", text);
    const tab = await open(browser, "fault.html");
    for (const [v, view] of views.entries()) {
      const { image, allowed } = references[1][v], found = compare(await page_image(tab, v, POSES[1]), image, allowed);
      expect(found.beyond > 0.02, `${name}: not seen in ${view.name}: ${found.beyond} of the pixels are beyond the bound`);
    }
    await tab.close();
  }
  return Object.keys(faults).length;
}

const browser = await launch();
const tab = await open(browser, "place.html");
const worst = await check_images(tab);
await tab.close();
make_cost_case();
const coarse = await open(browser, "coarse.html");
await check_costs(coarse);
await coarse.close();
const planted = await check_planted(browser);
await browser.close();
finish(`the page's DRRs reach ${worst.toFixed(2)} of the bound; ${planted} planted faults seen`);
