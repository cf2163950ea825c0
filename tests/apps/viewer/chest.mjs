// On a real chest CT: an X-ray pair, an object 30 mm off, two drags, start.json saved, `register` from there.
import { existsSync } from "node:fs";
import { join } from "node:path";
import { placed_by_drags } from "./by_drags.mjs";
import { data, expect, finish, run } from "./browser.mjs";
import { page_data, write_json, write_pose } from "./case.mjs";
import { euler, product, shift } from "./linear.mjs";

const ct = join(data, "chest/lidc-0314-half.nii.gz");
if (!existsSync(ct)) {
  console.log(`skipped: there is no ${ct}`);
  process.exit(process.env.RAYLIGN_REQUIRE_DATA ? 1 : 77);
}
const c_arm = { sad_mm: 1000, sdd_mm: 1500, secondary_angle_deg: 0, pixel_pitch_mm: [1.9, 1.9], size_px: [256, 256] };
write_json("geometry.json", { raylign: 1, views: [{ name: "AP", c_arm: { ...c_arm, primary_angle_deg: 0 } }, { name: "LAT", c_arm: { ...c_arm, primary_angle_deg: 90 } }] });
run(["place", "-v", ct, "--views", "geometry.json", "-o", "middle.html", "--quiet"]);
const truth = product(shift([4, -3, 6]), product(page_data("middle.html").start, euler(0.03, -0.02, 0.04)));
write_pose("truth.json", truth);
write_pose("off.json", product(shift([18, -17, 17]), truth));
run(["drr", "-v", ct, "--views", "geometry.json", "--pose", "truth.json", "--noise", "20000", "-o", "xrays", "--quiet"]);
const { command, correlations } = await placed_by_drags("chest", ["-v", ct, "--views", "xrays/views.json"], "off.json", truth);
correlations.after.forEach((value, i) => expect(value > correlations.before[i] + 0.2, `view ${i + 1}: the correlation rises from ${correlations.before[i]} to ${value}`));
expect(command.join(" ").endsWith("--views xrays/views.json --start downloads/chest/start.json -o result"), `the command goes on from it: ${command.join(" ")}`);
const report = JSON.parse(run([...command, "--truth", "truth.json", "--json", "--quiet"], [0]));
expect(report.verdict.ok, `register believes its result: ${report.verdict.reasons}`);
expect(report.tre.initial_mtre_mm < 6 && report.tre.final_mtre_mm < 0.2, `register ends right: ${JSON.stringify(report.tre)}`);
finish(`from 30 mm by two drags to ${report.tre.initial_mtre_mm.toFixed(2)} mm, by register to ${report.tre.final_mtre_mm.toFixed(3)} mm`);
