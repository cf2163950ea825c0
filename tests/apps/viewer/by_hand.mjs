// Not a test of CTest's, as it takes minutes: the same on real X-rays, a radius and a knee's tibial component, 30 mm off. `viewer_test.sh by_hand ...`.
// Their reference poses are those of the data's SOURCE.md: no gold standards.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { placed_by_drags } from "./by_drags.mjs";
import { data, expect, finish, run } from "./browser.mjs";
import { write_json, write_pose } from "./case.mjs";
import { product, shift } from "./linear.mjs";

const off = [18, -17, 17];

async function check(name, arguments_, truth, more, most_mm) {
  write_pose(`${name}_truth.json`, truth);
  write_pose(`${name}_off.json`, product(shift(off), truth));
  const { command, correlations } = await placed_by_drags(name, arguments_, `${name}_off.json`, truth);
  console.log(`${name}: correlation ${correlations.before.map((c) => c.toFixed(3))} -> ${correlations.after.map((c) => c.toFixed(3))}`);
  const began = performance.now(), report = JSON.parse(run([...command.slice(0, -1), `${name}_result`, ...more, "--truth", `${name}_truth.json`, "--json", "--quiet"], [0, 1]));
  console.log(`${name}: from ${Math.hypot(...off).toFixed(1)} mm by ${correlations.after.length} drags to ${report.tre.initial_mtre_mm.toFixed(2)} mm, by register (${((performance.now() - began) / 1000).toFixed(0)} s) to ` +
    `${report.tre.final_mtre_mm.toFixed(3)} mm from the reference; ${report.verdict.ok ? "ok" : `doubtful: ${report.verdict.reasons.join("; ")}`}`);
  expect(report.tre.final_mtre_mm < most_mm, `${name}: register ends within ${most_mm} mm of the reference`);
}

// The reference has the volume's middle as its origin.
const wrist = (file) => join(data, "wrist", file), spacing = [0.39625, 0.39625, 0.625], size = [68, 86, 128];
const { R, t } = JSON.parse(readFileSync(wrist("reference_poses.json"), "utf8"))[0], middle = size.map((n, i) => ((n - 1) / 2) * spacing[i]);
await check("wrist", ["-v", wrist("rad_dcm_cropped.tif"), "--spacing", spacing.join(","), "--hu-offset", "-1024",
  "--views", ...[1, 2].map((cam) => `${wrist(`xr_calib_wrist_cam0${cam}.txt`)}=${wrist(`xr_rad_uln_cam0${cam}_UND.0002.tif`)}`), "--undistorted", "true"],
product([...R.map((row, r) => [...row, t[r]]), [0, 0, 0, 1]], shift(middle.map((x) => -x))), [], 1.5);

// One instant of the sequence.
const knee = join(data, "knee-biplane"), { views } = JSON.parse(readFileSync(join(knee, "views.json"), "utf8"));
write_json("knee.json", { raylign: 1, views: views.map(({ frames, ...view }) => ({ ...view, image: join(knee, (frames.files ?? frames)[0]) })) });
await check("knee", ["-v", join(knee, "tibia0.stl"), "--material", "titanium", "--mesh-spacing", "0.5", "--views", "knee.json"],
  JSON.parse(readFileSync(join(knee, "start_tib.json"), "utf8")).world_from_ct, ["--content", "part"], 1.5);
finish("placed by hand");
