"use strict";
// One function a kind of report.

// Columns of the pose's rotation are the CT's axes in the world.
const turnOf = (matrix) => [0, 1, 2].map((r) => matrix[r].slice(0, 3));
const timesTransposed = (a, b) => [0, 1, 2].map((r) => [0, 1, 2].map((c) => [0, 1, 2].reduce((sum, k) => sum + a[k][r] * b[k][c], 0)));  // a^T b
const LPS = ["left-right (x to the left)", "front-back (y to the back)", "foot-head (z to the head)"];

// Rotation vector [degrees] of a rotation matrix.
function rotationVector(m) {
  const axis = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]], sine = Math.hypot(...axis) / 2, angle = Math.atan2(sine, (m[0][0] + m[1][1] + m[2][2] - 1) / 2);
  return axis.map((x) => (sine > 1e-9 ? ((x / (2 * sine)) * angle * 180) / Math.PI : 0));
}
// Standard deviation along a direction, of the 3 x 3 block of the covariance that begins at `from`.
const sigmaAlong = (covariance, from, d) => Math.sqrt(Math.max(0, d.reduce((sum, x, r) => sum + d.reduce((part, y, c) => part + x * y * covariance[from + r][from + c], 0), 0)));

function poseSection(report) {
  const end = report.world_from_ct, start = report.start_world_from_ct, turned = rotationVector(timesTransposed(turnOf(start), turnOf(end)));
  const column = (c) => [0, 1, 2].map((r) => end[r][c]), known = report.covariance, centre = data.viewer?.objects?.[0]?.centre_ct_mm;
  const placed = (m) => [0, 1, 2].map((r) => m[r][3] + [0, 1, 2].reduce((sum, k) => sum + m[r][k] * centre[k], 0));
  const by = centre && placed(end).map((x, r) => x - placed(start)[r]), along = (c) => by && column(c).reduce((sum, x, r) => sum + x * by[r], 0);
  const rows = LPS.map((name, c) => ({ name, moved: along(c), turned: turned[c], sigma_mm: known && sigmaAlong(known, 3, column(c)), sigma_deg: known && (sigmaAlong(known, 0, column(c)) * 180) / Math.PI }));
  const views = known ? report.views.map((view) => ({ name: view.name, axes: view.camera_from_world.slice(0, 3).map((row) => sigmaAlong(known, 3, row.slice(0, 3))) })) : [];
  section("Pose", "What the registration moved (the object's centre) and turned, and how sure it is (1 σ of chance), in the patient's directions." + (known ? "" : " How sure it is, is not told of a pose in doubt."),
    table([{ name: "Direction", key: "name", text: true, show: String }, { name: "Moved along it since the start", key: "moved", show: mm }, { name: "Turned about it since the start", key: "turned", show: degrees }, { name: "σ along it", key: "sigma_mm", show: mm }, { name: "σ about it", key: "sigma_deg", show: degrees }], rows),
    views.length ? el("div", { class: "below" }, table([{ name: "As a view sees it", key: "name", text: true, show: String }, { name: "σ along its columns", value: (v) => v.axes[0], show: mm }, { name: "σ along its rows", value: (v) => v.axes[1], show: mm }, { name: "σ in depth", value: (v) => v.axes[2], show: mm }], views)) : null,
    el("details", { class: "below" }, el("summary", {}, "world_from_ct: maps points of the CT (LPS, mm) to the world of the views"),
      table([0, 1, 2, 3].map((c) => ({ name: c < 3 ? "xyz"[c] : "mm", value: (row) => row.r[c], show: (v) => v.toFixed(c < 3 ? 6 : 3) })), end.map((r) => ({ r })))));
}

// What `place` and `register` have in common: the CT and the views.
const PLACE_OPTIONS = new Set(["-v", "--volume", "--hu", "--hu-offset", "--attenuation", "--series", "--spacing", "--labels", "--label", "--labels-table", "--object", "--bone", "--segment-bones", "--rest", "--bone-threshold", "--clip", "--material", "--mesh-spacing", "--mesh-unit", "--views", "--undistorted", "--auto-mask"]);

// The command that shows this result in a page to correct it, from the command that made it. Words stay quoted as they are.
// `starts`: --start's values, for the folder of the results.
function placeCommand(command, starts = (folder) => [`${folder}/pose.json`]) {
  const words = command.match(/(?:'[^']*'|\\.|[^\s'\\])+/g) ?? [], kept = [];
  let keep = false, isFolder = false, folder = ".";
  for (const word of words.slice(words.indexOf("register") + 1)) {
    const [, name, value] = /^(-v|-o|--?[a-z][a-z0-9-]*)(?:=?(.+))?$/s.exec(word) ?? [];
    if (name) { keep = PLACE_OPTIONS.has(name); isFolder = name === "-o" || name === "--output"; if (isFolder && value) folder = value; }
    if (keep) kept.push(word);
    else if (isFolder && !name) folder = word;
  }
  return [words[0], "place", ...kept, ...starts(folder).flatMap((start) => ["--start", start]), "-o", `${folder}/place.html`].join(" ");
}

// Where the page carries the viewer, the result is corrected here; it opens on request, since it is at work then.
const haveViewer = Boolean(data.viewer) && typeof globalThis.raylign_viewer === "function";
function viewerSection(note) {
  if (!haveViewer) return;
  const host = el("div", { id: "viewer-host" }), open = el("button", { type: "button", id: "open-viewer", onclick: () => openViewer() }, "Open the live DRRs");
  section("Correct it by hand", note, el("div", { id: "viewer-section" }, open, host)).classList.add("on-screen");
}
// At a frame, of a track.
let viewerOpened = null;
function openViewer(frame) {
  const host = document.getElementById("viewer-host");
  document.getElementById("open-viewer")?.remove();
  viewerOpened ??= globalThis.raylign_viewer(host, data.viewer, data.viewer_style);
  viewerOpened.then(() => { if (frame !== undefined) globalThis.raylign.go_to(data.viewer.frames.findIndex((f) => f.number === frame)); })
    .catch((error) => { host.textContent = `The live DRRs cannot be shown: ${error.message}`; });
}
function toViewer() {
  return el("a", { href: "#viewer-section", onclick: () => openViewer() }, "Correct it by hand");
}

function nextSteps(report) {
  if (haveViewer) {
    return report.verdict.ok ? ["Look at the outlines below: they must lie on the bones of every X-ray. The pose is in ", el("code", {}, "pose.json"), " and ", el("code", {}, "pose.tfm"), ". They do not? ", toViewer(), "."]
      : ["Look at the outlines below. Where they do lie on the bones, the reasons say what to mend. Where they do not: ", toViewer(), "."];
  }
  const correct = [el("pre", { id: "place-command" }, placeCommand(report.command)), "There it can be moved, with live DRRs; ", el("code", {}, "start.json"), " saved there is a start for the same command again."];
  if (report.verdict.ok) return ["Look at the outlines below: they must lie on the bones of every X-ray. The pose is in ", el("code", {}, "pose.json"), " and ", el("code", {}, "pose.tfm"), ".",
    el("details", {}, el("summary", {}, "They do not? Correct it by hand"), correct)];
  return ["Look at the outlines below. Where they do lie on the bones, the reasons say what to mend. Where they do not, correct it by hand:", correct];
}

function registerCards(report) {
  const cards = [];
  if (report.tre) cards.push(["error against the truth (mTRE), start → result", `${mm(report.tre.initial_mtre_mm)} → ${mm(report.tre.final_mtre_mm)}`], ["as seen in the pictures (mRPD)", mm(report.tre.final_mrpd_mm)]);
  if (report.sigma && report.sigma.expected_error_mm > 0) {
    cards.push(["expected error (rms)", mm(report.sigma.expected_error_mm)]);
    if (report.sigma.in_depth_mm) cards.push(["expected in the plane / in depth", `${mm(report.sigma.in_plane_mm)} / ${mm(report.sigma.in_depth_mm)}`]);
  }
  cards.push(["gradient correlation, start → result (1 = alike)", `${(1 - report.cost.initial).toFixed(3)} → ${(1 - report.cost.final).toFixed(3)}`]);
  if (report.content === "part") cards.push(["of what the X-ray shows, registered as", "a part"]);
  if (report.search?.refined > 0) cards.push(["of the other starts refined, ended at this pose", `${number(report.search.agreeing)} of ${number(report.search.refined)}`], ["other poses that fit as well", report.search.rivals.length ? number(report.search.rivals.length) : "none"]);
  cards.push(["time in all", seconds(report.time_s.total)]);
  return cards;
}

function registerPage({ report, images }) {
  heading("Registration", report.inputs?.[0] ? report.inputs.map((i) => i.path.split("/").pop()).join(", ") : "");
  verdict(report.verdict.ok, report.verdict.ok ? "Registered: no reason to doubt was found" : "Doubtful: do not use the result unchecked", report.verdict.reasons, registerCards(report), nextSteps(report));
  section("X-ray and DRR", "The outline of the CT projected at the pose found, over the X-ray. Choose a DRR instead and move the slider: left of it the X-ray, right of it the DRR. Letters: the patient's left, right, front (A), back (P), head, feet. Pictures are what the detector sees from the source, unless mirrored.",
    overlays(images, report.views.map((view) => sidesOf(view.camera_from_world, report.world_from_ct))));
  viewerSection("Live DRRs over the X-rays, from a smaller copy of the CT that this page carries. What is moved here is saved as a start, and the page says how to go on from it.");
  poseSection(report);
  const times = report.time_s, staged = STAGES.reduce((sum, [key]) => sum + (times[key] ?? 0), 0), others = { ...times, rest: Math.max(0, times.total - (times.load ?? 0) - staged) };
  const steps = report.history.map((h, i) => ({ ...h, step: i + 1 }));
  const levels = [...new Set(steps.map((s) => s.level))];
  const perLevel = levels.map((l) => ({ label: `level ${l + 1} of ${report.levels.length}`, i: l }));
  section("Convergence", "Cost and length of every accepted step, coarse to fine. Costs of different levels are those of different images.", charts(() => [
    chart("Cost of every step", null, { x: { label: "accepted step", tickFormat: "d" }, y: costAxis("cost (0 = perfect, 1 = unrelated)", steps.map((s) => s.cost)),
      marks: [...levels.map((l) => Plot.line(steps.filter((s) => s.level === l), { x: "step", y: "cost", stroke: colour(l), strokeDasharray: dash(l), strokeWidth: 2 })),
        Plot.dot(steps, { x: "step", y: "cost", fill: (s) => colour(s.level), r: 3, title: (s) => `level ${s.level + 1}, step ${s.iteration}: ${number(s.cost, 5)}` })] }, perLevel),
    chart("Length of every step", "how far the step moved the object's rim", { x: { label: "accepted step", tickFormat: "d" }, y: { label: "mm", ...spanAxis(steps.map((s) => s.step_mm)) },
      marks: [Plot.line(steps.filter((s) => s.step_mm > 0), { x: "step", y: "step_mm", stroke: colour(0), strokeWidth: 2 }),
        Plot.dot(steps.filter((s) => s.step_mm > 0), { x: "step", y: "step_mm", fill: (s) => colour(s.level), r: 3 })] }),
    stageBars("Time", `where the ${seconds(times.total)} went`, [{ label: report.backend.name, times: others }], [["load", "reading files"], ...STAGES, ["rest", "search, checks, pictures"]])]),
    table([{ name: "Level", value: (l) => report.levels.indexOf(l) + 1 }, { name: "Volume", value: (l) => l.volume_size.join(" × "), text: true, show: String },
      { name: "Images", value: (l) => l.image_sizes_px.map((s) => s.join(" × ")).join(", "), text: true, long: true, show: String },
      { name: "Cost before", value: (l) => l.cost.initial, show: (v) => number(v, 4) }, { name: "after", value: (l) => l.cost.final, show: (v) => number(v, 4) },
      { name: "Steps", key: "iterations" }, { name: "Poses compared", value: (l) => l.evaluations + l.linearizations },
      { name: "Ended by", key: "termination", text: true, show: String }, { name: "Time", key: "time_s", show: seconds }], report.levels));
  section("Views", null, table([{ name: "View", key: "name", text: true, show: String }, { name: "Gradient correlation", value: (v) => 1 - v.cost, show: (v) => v.toFixed(3) }], report.views));
  manifest(report, [["backend", backendText(report.backend)], ["search", report.search?.mode && `${report.search.mode}, ${number(report.search.starts)} starts compared`], ["method", report.method + (report.method_reason ? ` (${report.method_reason})` : "")], ["metric", report.metric], ["projector", report.projector]]);
}

const PERCENTILES = ["p50", "p75", "p95", "p99", "max"];
const percentileColumns = (key, name, unit) => PERCENTILES.map((p) => ({ name: `${name} ${p}${unit ? " " + unit : ""}`, value: (r) => r[key]?.[p] }));

// Expected against true error of the trials that were believed; a trial below the upper line has less error than twice the expected one.
function calibrationChart(trials, cases, legend) {
  const dots = trials.filter((t) => t.verdict_ok && t.expected_error_mm > 0 && t.final_mtre_mm > 0);
  if (!dots.length) return [];
  const x = spanAxis(dots.map((t) => t.expected_error_mm)), y = spanAxis(dots.map((t) => t.final_mtre_mm));
  const low = x.type === "log" ? Math.min(...dots.map((t) => t.expected_error_mm)) : y.type === "log" ? Math.min(...dots.map((t) => t.final_mtre_mm)) / 2 : 0, high = Math.max(...dots.map((t) => t.expected_error_mm));
  const span = high > low ? [low, high] : [0.9 * low, 1.1 * high];
  const places = Array.from({ length: 60 }, (_, k) => span[0] * (1 - k / 59) + (span[1] * k) / 59);
  const ray = (factor) => Plot.line(places.map((e) => ({ e, t: factor * e })), { x: "e", y: "t", stroke: COLOURS[7], strokeDasharray: factor === 2 ? null : "4 3", clip: true });
  return [chart("Expected and true error", "of the trials that were believed; line: twice the expected error, dashed: as much", { x: { label: "expected error in mm", ...x }, y: { label: "final mTRE in mm", ...y },
    marks: [ray(1), ray(2), Plot.dot(dots, { x: "expected_error_mm", y: "final_mtre_mm", stroke: (t) => colour(t.case), r: 2.5, title: (t) => `trial ${t.trial}: ${number(t.final_mtre_mm)} mm, expected ${number(t.expected_error_mm)}` })] }, legend)];
}

function scenePage({ report, images }) {
  heading("Registration of several objects", report.objects.map((o) => o.name).join(", "));
  const moving = report.objects.filter((o) => o.moves);
  const cards = [["objects ok", `${moving.filter((o) => o.verdict.ok).length} of ${moving.length}`], ["gradient correlation, start → result (1 = alike)", `${(1 - report.cost.initial).toFixed(3)} → ${(1 - report.cost.final).toFixed(3)}`], ["time in all", seconds(report.time_s.total)]];
  for (const o of moving) if (o.sigma) cards.push([`${o.name}: expected error (rms)`, mm(o.sigma.expected_error_mm)]);
  verdict(report.verdict.ok, report.verdict.ok ? "Registered: no reason to doubt was found" : "Doubtful: look at the objects", report.verdict.reasons, cards, ["Look at the outlines below: they must lie on the bones of every X-ray. They do not? ", ...(haveViewer ? [toViewer(), "."]
    : ["Correct them by hand:", el("pre", { id: "place-command" }, placeCommand(report.command, (folder) => moving.map((o) => `${o.name}=${folder}/pose_${o.name}.json`)))])]);
  section("X-ray and DRR", "The outline of each object projected at its pose, in a colour of its own, over the X-ray. Choose a DRR instead and move the slider: left of it the X-ray, right of it all objects." + (haveViewer ? " Letters: the patient's left, right, front (A), back (P), head, feet, as the first object's CT has them." : ""),
    overlays(images, haveViewer ? data.viewer.views.map((view) => sidesOf(view.camera_from_world, report.objects[0].world_from_ct)) : []));
  viewerSection("Live DRRs over the X-rays, from smaller copies of the objects that this page carries. Choose an object and move it; all together are saved as a start.");
  if (report.collisions.length) section("Collisions", "Objects that share space at the poses found: nothing forbids it. A layer of voxels is what half a voxel of motion makes.", table([{ name: "Objects", value: (c) => c.objects.join(", "), text: true, show: String }, { name: "Shared mm³", key: "volume_mm3" }, { name: "of the smaller one", key: "share", show: percent }], report.collisions));
  section("Objects", "Each is judged against what the others leave of the X-rays.", table([{ name: "Object", key: "name", text: true, show: String }, { name: "Verdict", value: (o) => (o.moves ? (o.verdict.ok ? "ok" : "doubtful") : "stays"), text: true, show: String },
    { name: "Expected error", value: (o) => o.sigma?.expected_error_mm, show: mm }, { name: "Gradient correlation", value: (o) => 1 - o.cost.final, show: (v) => v.toFixed(3) },
    { name: "mTRE at the start", value: (o) => o.tre?.initial_mtre_mm, show: mm }, { name: "as found", value: (o) => o.tre?.final_mtre_mm, show: mm },
    { name: "Reasons", value: (o) => o.verdict.reasons.join("; "), text: true, long: true, show: String }], report.objects, (o) => !o.verdict.ok));
  if (report.joints.length) section("Joints", "CT axes in the objects' centres of attenuation.", table([{ name: "Proximal", key: "proximal", text: true, show: String }, { name: "Distal", key: "distal", text: true, show: String }, { name: "Sequence", key: "sequence", text: true, show: String },
    ...[0, 1, 2].map((i) => ({ name: `Angle ${i + 1}`, value: (j) => j.angles_deg[i], show: degrees })), ...[0, 1, 2].map((i) => ({ name: "xyz"[i], value: (j) => j.translation_mm[i], show: mm })), { name: "Parted since the CT", value: (j) => j.since_ct?.apart_mm, show: mm }, { name: "Turned since the CT", value: (j) => j.since_ct?.turned_deg, show: degrees },
    { name: "Limit", value: (j) => (j.limit ? `${number(j.limit.apart_mm)} mm, ${number(j.limit.turned_deg)}°${j.limit.used ? "" : ", not used"}` : ""), text: true, show: String }], report.joints));
  manifest(report, [["backend", backendText(report.backend)], ["method", report.method], ["metric", report.metric], ["projector", report.projector], ["moving all together", seconds(report.time_s.together)]]);
}

function studyPage({ report, trials, images }) {
  const cases = report.cases, settings = report.settings;
  const sum = (key) => cases.reduce((s, c) => s + c.overall[key], 0);
  const done = sum("trials"), good = sum("successes"), missed = sum("undetected_failures"), alarms = sum("false_alarms");
  heading("Robustness study", `${settings.bins} mm initial mTRE, ${settings.per_bin} starts an interval, ${cases.length} case${cases.length === 1 ? "" : "s"}${settings.preset ? ", preset " + settings.preset : ""}`);
  const reasons = [];
  if (missed) reasons.push(`${missed} failure${missed === 1 ? "" : "s"} passed the program's own verdict`);
  if (alarms) reasons.push(`${alarms} success${alarms === 1 ? " was" : "es were"} called doubtful`);
  const photons = settings.noise_photons ? `, ${number(settings.noise_photons)} photons` : ", no noise";
  const noise = settings.noise_photons === null ? `, ${number(report.xray_model.photons_per_mm2)} photons/mm²` : photons;
  if (report.simulated_views.length) reasons.push(`X-rays of ${report.simulated_views.join(", ")} are simulated from the CT itself (${report.simulation}${noise}): ${settings.xray === "ideal" ? "that flatters, real ones are harder" : "real ones differ from the model, too"}`);
  verdict(missed === 0, `${good} of ${done} registrations succeeded`, reasons,
    cases.map((c) => [c.label, `${percent(c.overall.success_rate)}, captures ${number(c.capture_range_mm)} mm`]));
  const points = cases.flatMap((c, i) => c.intervals.filter((b) => b.trials).map((b) => ({ ...b, i,
    middle: (b.low_mm + b.high_mm) / 2 + (i - (cases.length - 1) / 2) * 0.05 * (b.high_mm - b.low_mm) })));  // side by side where they are equal
  const legend = cases.map((c, i) => ({ label: c.label, i }));
  const of = (i) => points.filter((p) => p.i === i);
  section("Success", "Share of the trials that succeeded against the initial error; bands: Wilson intervals, 95 %. A band is what the number of trials proves.", charts(() => [
    chart("Success rate", null, { x: { label: "initial mTRE in mm", domain: [Math.min(...points.map((p) => p.low_mm)), Math.max(...points.map((p) => p.high_mm))] }, y: { label: "share of the trials", domain: [0, 1], grid: true, tickFormat: (v) => percent(v) }, insetTop: 5, insetBottom: 5,
      marks: [...cases.map((c, i) => Plot.areaY(of(i), { x: "middle", y1: "success_low", y2: "success_high", fill: colour(i), fillOpacity: 0.12 })),
        ...cases.map((c, i) => Plot.line(of(i), { x: "middle", y: "success_rate", stroke: colour(i), strokeDasharray: dash(i), strokeWidth: 2 })),
        Plot.link(points, { x1: "middle", x2: "middle", y1: "success_low", y2: "success_high", stroke: (p) => colour(p.i), strokeOpacity: 0.5 }),
        Plot.dot(points, { x: "middle", y: "success_rate", fill: (p) => colour(p.i), r: 3.5, title: (p) => `${cases[p.i].label}, ${p.low_mm}-${p.high_mm} mm: ${p.successes} of ${p.trials}` })] }, legend),
    chart("Final mTRE of every trial", "circles: succeeded, crosses: failed", { x: { label: "initial mTRE in mm" }, y: { label: "final mTRE in mm", ...spanAxis(trials.map((t) => t.final_mtre_mm)) },
      marks: [Plot.dot(trials.filter((t) => t.final_mtre_mm > 0), { x: "initial_mtre_mm", y: "final_mtre_mm", stroke: (t) => colour(t.case), r: 2.5, symbol: (t) => (t.success ? "circle" : "times"), title: (t) => `trial ${t.trial}: ${number(t.final_mtre_mm)} mm` })] }, legend),
    ...calibrationChart(trials, cases, legend),
    chart("In-plane, depth, rotation", "medians (circles) and 95th percentiles (diamonds) over all trials, seen by the case's first view", (() => {
      const bars = cases.flatMap((c, i) => [["in-plane mm", "in_plane_mm"], ["depth mm", "depth_mm"], ["rotation °", "rotation_deg"]].map(([what, key]) => ({ what, i, label: c.label, ...c.overall[key] })));
      return { marginLeft: 12, marginRight: 96, height: 60 + 3 * (14 + 20 * cases.length), x: { label: "mm or degrees", ...spanAxis(bars.flatMap((b) => [b.p50, b.p95])) }, y: { axis: null, domain: cases.map((c) => c.label), padding: 0.5 },
        fy: { label: null, axis: "right", domain: ["in-plane mm", "depth mm", "rotation °"] },
        marks: [Plot.link(bars, { fy: "what", x1: "p50", x2: "p95", y1: "label", y2: "label", stroke: (b) => colour(b.i), strokeWidth: 2 }), Plot.dot(bars, { fy: "what", x: "p50", y: "label", fill: (b) => colour(b.i), r: 5, title: (b) => `${b.label}: p50 ${number(b.p50)}, p95 ${number(b.p95)}` }),
          Plot.dot(bars, { fy: "what", x: "p95", y: "label", symbol: "diamond", fill: (b) => colour(b.i), r: 4 })] };
    })(), legend),
    stageBars("Mean time of a registration", null, cases.map((c) => ({ label: c.label, times: c.mean_time_s })))]));
  section("Cases", "Percentiles over all trials, failures included.", table([{ name: "Case", key: "label", text: true, show: String },
    { name: "Trials", value: (c) => c.overall.trials }, { name: "Success", value: (c) => c.overall.success_rate, show: percent },
    { name: "95 % interval", value: (c) => c.overall.success_low, show: (v, c) => `${percent(v)} to ${percent(c.overall.success_high)}` },
    { name: "Capture range mm", key: "capture_range_mm" }, { name: "Success is", value: (c) => `${c.success_means.error} < ${number(c.success_means.below_mm)} mm`, text: true, show: String },
    { name: "Failures missed", value: (c) => c.overall.undetected_failures }, { name: "False alarms", value: (c) => c.overall.false_alarms },
    { name: "Below twice the expected error", value: (c) => c.overall.expected_error.rate, show: (v, c) => (c.overall.expected_error.trials ? `${percent(v)} of ${c.overall.expected_error.trials}` : "–") }, { name: "Ended by error", key: "errors" }], cases, (c) => c.overall.undetected_failures > 0),
    table([{ name: "Case", key: "label", text: true, show: String }, ...["mtre_mm", "mrpd_mm"].flatMap((key) => percentileColumns(key, key === "mtre_mm" ? "mTRE" : "mRPD", "mm")).map((c) => ({ ...c, value: (r) => c.value(r.overall) }))], cases),
    table([{ name: "Case", key: "label", text: true, show: String }, ...[["in_plane_mm", "in-plane", "mm"], ["depth_mm", "depth", "mm"], ["rotation_deg", "rotation", "°"]].flatMap(([k, n, u]) => ["p50", "p95", "max"].map((p) => ({ name: `${n} ${p} ${u}`, value: (c) => c.overall[k][p] })))], cases),
    table([{ name: "Case", key: "label", text: true, show: String }, { name: "time p50", value: (c) => c.overall.time_s.p50, show: seconds }, { name: "time p95", value: (c) => c.overall.time_s.p95, show: seconds },
      { name: "evaluations p50", value: (c) => c.overall.evaluations.p50 }, { name: "linearizations p50", value: (c) => c.overall.linearizations.p50 }], cases));
  if (images.length) section("The worst trial of each case", "Left of the slider the X-ray, right of it the DRR at the pose that was found.", overlays(images));
  section("Intervals", null, table([{ name: "Case", value: (p) => cases[p.i].label, text: true, show: String }, { name: "From mm", key: "low_mm" }, { name: "to mm", key: "high_mm" },
    { name: "Trials", key: "trials" }, { name: "Succeeded", key: "successes" }, { name: "Rate", key: "success_rate", show: percent }, { name: "95 % from", key: "success_low", show: percent }, { name: "to", key: "success_high", show: percent },
    { name: "mTRE p50 mm", value: (p) => p.mtre_mm.p50 }, { name: "p95 mm", value: (p) => p.mtre_mm.p95 }, { name: "mRPD p50 mm", value: (p) => p.mrpd_mm.p50 }, { name: "p95 mm", value: (p) => p.mrpd_mm.p95 },
    { name: "time p50", value: (p) => p.time_s.p50, show: seconds }], points, (p) => p.successes < p.trials));
  if (report.agreement.length) {
    section("Backends against each other", "Final poses from the same starts.", table([{ name: "First", key: "first", text: true, show: String }, { name: "Second", key: "second", text: true, show: String },
      { name: "Trials", key: "trials" }, ...percentileColumns("poses_apart_mm", "apart", "mm"), { name: "One succeeds, other fails", key: "one_succeeds_other_fails" }], report.agreement));
  }
  if (report.left_out.length) section("Left out", null, table([{ name: "Backend", key: "backend", text: true, show: String }, { name: "Why", key: "reason", text: true, long: true, show: String }], report.left_out));
  const failed = trials.filter((t) => !t.success || !t.verdict_ok).sort((a, b) => b.final_mtre_mm - a.final_mtre_mm).slice(0, 100);
  if (failed.length) {
    section("Failed and doubted trials", `The ${failed.length} worst. Run one alone: add --trial NUMBER to the command below.`, table([{ name: "Trial", key: "trial" }, { name: "Case", value: (t) => cases[t.case].label, text: true, show: String },
      { name: "Initial mTRE mm", key: "initial_mtre_mm" }, { name: "Final mm", key: "final_mtre_mm" }, { name: "Success", key: "success", text: true, show: (v) => (v ? "yes" : "no") }, { name: "Verdict", key: "verdict_ok", text: true, show: (v) => (v ? "ok" : "doubtful") },
      { name: "Reasons", value: (t) => t.error || t.reasons, text: true, long: true, show: String }], failed, (t) => !t.success && t.verdict_ok));
  }
  const last = report.runs[report.runs.length - 1] ?? {};
  manifest({ ...report, machine: last }, [["runs", report.runs.length], ["processes of the last run", last.processes], ["targets", report.targets],
    ...report.backends.map((b) => ["backend", backendText(b)]), ...Object.entries(settings).filter(([k]) => k !== "seed").map(([k, v]) => [k.replaceAll("_", " "), v === "" ? null : v])]);
}

function comparePage({ report, images }) {
  const bad = report.rows.filter((r) => !r.agrees);
  const backends = report.backends.map((b) => b.name);
  heading("Backends compared", `${backends.slice(1).join(", ")} against ${backends[0]}`);
  verdict(report.agrees, report.agrees ? `All ${report.rows.length} comparisons agree` : `${bad.length} of ${report.rows.length} comparisons disagree`,
    bad.slice(0, 6).map((r) => `${r.other}: ${r.quantity}: ${number(r.value)} ${r.unit} (allowed ${number(r.tolerance)}) ${r.where}`),
    backends.slice(1).map((name) => [name, `${report.rows.filter((r) => r.other === name && r.agrees).length} of ${report.rows.filter((r) => r.other === name).length} agree`]));
  section("Comparisons", "Largest difference to the oracle, what is allowed, and why.", table([{ name: "Backend", key: "other", text: true, show: String }, { name: "Quantity", value: (r) => r.quantity + (r.unit ? `, ${r.unit}` : ""), text: true, long: true, show: String },
    { name: "Largest", key: "value", show: (v) => (v === null ? "∞" : number(v)) }, { name: "RMS", key: "rms", show: (v) => (v ? number(v) : "–") }, { name: "Allowed", key: "tolerance" },
    { name: "Agrees", key: "agrees", text: true, show: (v) => (v ? "yes" : "NO") }, { name: "Where", key: "where", text: true, long: true, show: String }, { name: "Why so much is allowed", key: "reason", text: true, long: true, show: String }], report.rows, (r) => !r.agrees));
  if (images.length) section("X-ray and DRRs", "Left of the slider the X-ray, right of it each backend's DRR at the given pose.", overlays(images));
  const legend = backends.map((label, i) => ({ label, i }));
  const parameters = [...new Set(report.sweeps.map((s) => s.parameter))];
  section("Sweeps", "Cost along each pose parameter, from the given pose. The valleys must lie at one place.", charts(() => parameters.map((parameter) => {
    const curves = report.sweeps.filter((s) => s.parameter === parameter);
    const dots = curves.flatMap((s) => s.offsets.map((x, k) => ({ x, y: s.costs[k], i: backends.indexOf(s.backend) })));
    return chart((curves[0].unit === "mm" ? "along " : "") + parameter, null, { height: 240, x: { label: curves[0].unit }, y: { label: "cost", grid: true },
      marks: [...backends.map((name, i) => Plot.line(dots.filter((d) => d.i === i), { x: "x", y: "y", stroke: colour(i), strokeDasharray: dash(i), strokeWidth: i ? 2 : 3 })),
        Plot.ruleX(curves.filter((s) => s.minimum != null), { x: "minimum", stroke: (s) => colour(backends.indexOf(s.backend)), strokeOpacity: 0.6 })] }, legend);
  })), table([{ name: "Parameter", key: "parameter", text: true, show: String }, { name: "Backend", key: "backend", text: true, show: String }, { name: "Minimum at", key: "minimum", show: (v) => number(v, 5) }, { name: "", key: "unit", text: true, show: String }], report.sweeps));
  if (report.registrations.length) section("Registrations from the same starts", null, table([{ name: "Start", key: "start" }, { name: "Backend", key: "backend", text: true, show: String },
    { name: "mTRE to the oracle's result mm", key: "mtre_to_oracle_mm" }, { name: "to the given pose mm", key: "mtre_to_given_mm" }, { name: "Cost", key: "cost", show: (v) => number(v, 5) }, { name: "Iterations", key: "iterations" }, { name: "Time", key: "time_s", show: seconds }], report.registrations));
  manifest(report, report.backends.map((b) => ["backend " + b.name, backendText(b)]));
}

function benchPage({ report }) {
  const runs = report.registrations;
  heading("Performance", `${report.scene.volume_size.join(" × ")} voxels, ${report.scene.views} views of ${report.scene.image_size_px.join(" × ")} pixels, ${report.scene.name}`);
  const fastest = runs.filter((r) => r.ok).sort((a, b) => a.total_s - b.total_s)[0];
  verdict(runs.every((r) => r.ok), fastest ? `Fastest registration: ${seconds(fastest.total_s)} (${fastest.backend}, ${fastest.method})` : "No registration found the pose",
    runs.filter((r) => !r.ok).map((r) => `${r.backend}, ${r.method}: ${r.problem}`), runs.filter((r) => r.ok).map((r) => [`${r.backend}, ${r.method}`, seconds(r.total_s)]));
  const cell = (key) => ({ value: (r) => r.time_s[key], show: seconds });
  section("One registration, stage by stage", "The rows of Table 2 of Ino et al. 2006, for every backend of this machine; medians of the repetitions. A backend that does two stages in one pass counts them under the first.", charts(() => [
    stageBars("Time of a registration", null, runs.map((r) => ({ label: `${r.backend}, ${r.method}`, times: r.time_s })))]),
    table([{ name: "Backend", key: "backend", text: true, show: String }, { name: "Method", key: "method", text: true, show: String }, { name: "DRR", ...cell("drr") }, { name: "Gradient", ...cell("gradient") }, { name: "NCC reduction", ...cell("reduction") },
      { name: "Transfer", ...cell("transfer") }, { name: "Prepare", ...cell("prepare") }, { name: "Optimizer, rest", ...cell("optimizer") }, { name: "A step", key: "step_s", show: seconds }, { name: "Steps", key: "iterations" }, { name: "Total", key: "total_s", show: seconds },
      { name: "Evaluations", key: "evaluations" }, { name: "Linearizations", key: "linearizations" }, { name: "Read back bytes", key: "bytes_to_host" }, { name: "Backend's volume", key: "engine_volume_bytes", show: megabytes },
      { name: "mTRE before mm", key: "initial_mtre_mm" }, { name: "after mm", key: "final_mtre_mm" }], runs, (r) => !r.ok));
  const paper = report.paper;
  section("What the paper reports", paper.note, table([{ name: "Totals as printed", key: "series", text: true, show: String }, ...paper.totals[0].values.map((_, i) => ({ name: String(i + 1), value: (r) => r.values[i], text: true, show: String }))], paper.totals), el("p", { class: "note" }, paper.source));
  const kinds = [...new Set(report.scaling.map((s) => s.what))];
  const backends = [...new Set(report.scaling.map((s) => s.backend))];
  const legend = backends.map((label, i) => ({ label, i }));
  section("Scaling", "Time of one pose, all views, cost only (evaluate); the line of one quantity holds the others.", charts(() => kinds.map((what) => {
    const rows = report.scaling.filter((s) => s.what === what);
    return chart(what, null, { x: { label: rows[0].unit, ...(rows.length > backends.length ? { type: "log" } : {}), ticks: [...new Set(rows.map((r) => r.x))], tickFormat: "~d" }, y: { label: "ms a pose", ...spanAxis(rows.map((r) => r.pose_ms)) },
      marks: [...backends.map((name, i) => Plot.line(rows.filter((r) => r.backend === name), { x: "x", y: "pose_ms", stroke: colour(i), strokeDasharray: dash(i), strokeWidth: 2 })), Plot.dot(rows, { x: "x", y: "pose_ms", fill: (r) => colour(backends.indexOf(r.backend)), r: 3, title: (r) => `${r.backend}, ${r.x} ${r.unit}: ${number(r.pose_ms)} ms` })] }, legend);
  })), table([{ name: "Against", key: "what", text: true, show: String }, { name: "", key: "x" }, { name: "", key: "unit", text: true, show: String }, { name: "Backend", key: "backend", text: true, show: String }, { name: "ms a pose", key: "pose_ms" }, { name: "spread ms", key: "spread_ms" },
    { name: "poses/s", value: (r) => 1000 / r.pose_ms }, { name: "M rays/s", value: (r) => r.rays / r.pose_ms / 1000 }, { name: "Backend's volume", key: "engine_volume_bytes", show: megabytes }], report.scaling));
  manifest(report, [["most memory of the process", megabytes(report.peak_memory_bytes)], ...report.backends.map((b) => ["backend", backendText(b)])]);
  if (report.left_out.length) section("Left out", null, table([{ name: "Backend", key: "backend", text: true, show: String }, { name: "Why", key: "reason", text: true, long: true, show: String }], report.left_out));
}

function trackPage({ report, images }) {
  heading("Trajectory", `${report.objects.map((o) => o.name).join(", ")}: frames ${report.frames.first} to ${report.frames.last}, ${report.frames.done} of ${report.frames.planned} done`);
  const worst = (o) => (o.expected_error_mm ? `${mm(o.expected_error_mm.p50)} / ${mm(o.expected_error_mm.p95)}` : "–");
  verdict(report.verdict.ok, report.verdict.ok ? "Every frame is ok" : "Look at the flagged frames", report.verdict.reasons,
    [["of the frames planned, done", `${report.frames.done} of ${report.frames.planned}`], ...report.objects.flatMap((o) => [[`${o.name}: frames ok`, `${o.frames_by_status.ok} of ${o.frames.length}`], [`${o.name}: expected error, median / 95 %`, worst(o)]]), ["frames per second", number(report.frames_per_second, 2)]],
    report.verdict.ok ? ["Look at the pictures below; poses are in ", el("code", {}, "trajectory.csv"), "."] : ["Look at the flagged frames below: each says why. Their rows in ", el("code", {}, "trajectory.csv"), " have their status. ", haveViewer ? ["Where an object is off: ", toViewer(), "; what is moved there becomes a key frame, and the run is corrected from it both ways."]
      : ["Give a better pose of one of them by ", el("code", {}, "raylign place"), ", and correct the run from it with ", el("code", {}, "--keyframe N=start.json"), "."]].flat());
  const flagged = (o) => o.frames.filter((f) => f.status !== "ok");
  // A line ends where a frame has no pose, or where frames are not next to each other.
  const gaps = (frames) => frames.flatMap((f, i) => (i > 0 && f.frame > frames[i - 1].frame + 1 ? [{ frame: frames[i - 1].frame + 0.5 }, f] : [f]));
  const mark = { doubtful: COLOURS[4], lost: COLOURS[1], missing: COLOURS[7] };
  const flags = (frames) => Plot.ruleX(frames, { x: "frame", stroke: (f) => mark[f.status], strokeOpacity: 0.5, title: (f) => `${f.status}: ${(f.reasons ?? []).join("; ")}` });
  const searches = (o) => Plot.dot(o.frames.filter((f) => f.searched !== "none" && f.moved_mm), { x: "frame", y: 0, symbol: "triangle", stroke: COLOURS[6], title: (f) => `${f.searched} search${f.recovered ? ", recovered" : ""}` });
  const curves = (frames, key, names) => names.flatMap((name, i) => [Plot.line(gaps(frames), { x: "frame", y: (f) => f[key]?.[i] ?? NaN, stroke: colour(i), strokeDasharray: dash(i), strokeWidth: 2 }),
    Plot.dot(frames.filter((f) => f[key]), { x: "frame", y: (f) => f[key][i], fill: colour(i), r: 1.5 })]);  // a frame between two gaps has no line
  const axes = ["x", "y", "z"].map((label, i) => ({ label, i }));
  const line = (o, key, label) => chart(`${o.name}: ${label}`, null, { x: { label: "frame", tickFormat: "d" }, y: { label, grid: true, nice: true, tickFormat: (v) => number(v) },
    marks: [flags(flagged(o)), Plot.line(gaps(o.frames), { x: "frame", y: (f) => f[key] ?? NaN, stroke: colour(0), strokeWidth: 2 }), Plot.dot(o.frames.filter((f) => f[key] != null), { x: "frame", y: key, fill: colour(0), r: 1.5 })] });
  for (const j of report.joints) {
    section(`${j.distal} against ${j.proximal}`, `Angles in the order ${j.sequence}, the first about an axis of ${j.proximal}, the last about one of ${j.distal}; place of ${j.distal}'s origin in ${j.proximal}.`, charts(() => [
      chart("Angles", null, { x: { label: "frame", tickFormat: "d" }, y: { label: "degrees", grid: true, tickFormat: (v) => number(v) }, marks: [flags(j.frames.filter((f) => f.status !== "ok")), ...curves(j.frames, "angles_deg", [...j.sequence])] }, [...j.sequence].map((label, i) => ({ label: `${i + 1}: ${label}`, i }))),
      chart("Translation", null, { x: { label: "frame", tickFormat: "d" }, y: { label: "mm", grid: true, tickFormat: (v) => number(v) }, marks: [flags(j.frames.filter((f) => f.status !== "ok")), ...curves(j.frames, "translation_mm", ["x", "y", "z"])] }, axes)]));
  }
  const rows = report.objects.flatMap((o) => flagged(o).map((f) => ({ ...f, object: o.name, searched: f.searched === "none" ? null : f.searched }))).sort((a, b) => a.frame - b.frame).slice(0, 500);
  const atHand = new Set(haveViewer ? data.viewer.frames.map((f) => f.number) : []);
  const look = (frame) => (atHand.has(frame) ? el("a", { href: "#viewer-section", title: "open the live DRRs at this frame", onclick: () => openViewer(frame) }, String(frame)) : String(frame));
  if (rows.length) section("Flagged frames", (haveViewer ? "A number opens the frame in the live DRRs below. " : "") + (rows.length === 500 ? "The first 500; all are in trajectory.csv." : ""), table([{ name: "Frame", key: "frame", show: look }, { name: "Object", key: "object", text: true, show: String }, { name: "Status", key: "status", text: true, show: String },
    { name: "Searched", key: "searched", text: true, show: String }, { name: "Cost", key: "cost" }, { name: "Off the prediction", key: "jump_mm", show: mm }, { name: "Expected error", key: "expected_error_mm", show: mm },
    { name: "Reasons", value: (f) => (f.reasons ?? []).join("; "), text: true, long: true, show: String }], rows, (f) => f.status === "lost"));
  if (images.length) section("X-ray and DRR", "The first, the middle and the last frame, that of the largest cost, and up to four in doubt. Left of the slider the X-ray, right of it the CT projected: where it was sought first, and as found.", overlays(images));
  viewerSection("Live DRRs over the X-rays of " + (data.viewer?.frames.length ?? 0) + " of the frames: all of a short sequence, of a long one the flagged ones and others between them. An object that is moved in a frame makes it a key frame.");
  for (const o of report.objects) {
    section(o.name, "Since its first pose, in the world of the views. Upright lines are frames to look at: yellow doubtful, red lost, grey missing. Triangles: a wider search ran.", charts(() => [
      chart("Place of the CT's centre", null, { x: { label: "frame", tickFormat: "d" }, y: { label: "mm", grid: true, tickFormat: (v) => number(v) }, marks: [flags(flagged(o)), ...curves(o.frames, "moved_mm", ["x", "y", "z"]), searches(o)] }, axes),
      chart("Rotation vector", null, { x: { label: "frame", tickFormat: "d" }, y: { label: "degrees", grid: true, tickFormat: (v) => number(v) }, marks: [flags(flagged(o)), ...curves(o.frames, "turned_deg", ["x", "y", "z"]), searches(o)] }, axes),
      line(o, "cost", "cost"), line(o, "expected_error_mm", "expected error, mm"), line(o, "jump_mm", "off the predicted place, mm")]));
  }
  section("Objects", null, table([{ name: "Object", key: "name", text: true, show: String }, ...["ok", "doubtful", "lost", "missing"].map((s) => ({ name: s, value: (o) => o.frames_by_status[s] })), { name: "Searched", key: "searched" }, { name: "Recovered", key: "recovered" },
    { name: "Cost, median", value: (o) => o.cost?.p50 }, { name: "max", value: (o) => o.cost?.max }, { name: "Expected error, median", value: (o) => o.expected_error_mm?.p50, show: mm }, { name: "95 %", value: (o) => o.expected_error_mm?.p95, show: mm },
    { name: "Time a frame, median", value: (o) => o.time_s?.p50, show: seconds }, { name: "max", value: (o) => o.time_s?.max, show: seconds }], report.objects));
  manifest(report, [["backend", backendText(report.backend)], ["widest search", report.recover], ["time in all", seconds(report.time_s.total)], ["of it reading the volumes", seconds(report.time_s.load)], ["reading frames", seconds(report.time_s.read_frames)], ["registering", seconds(report.time_s.track)]]);
}

function batchPage({ report }) {
  const counts = report.jobs_by_status, all = report.jobs.length;
  heading("Batch", `${all} job${all === 1 ? "" : "s"}`);
  const reasons = report.jobs.filter((j) => j.status === "failed").slice(0, 10).map((j) => `${j.name}: ${j.reasons.join("; ")}`);
  verdict(counts.ok === all, `${counts.ok} of ${all} jobs are ok`, reasons, Object.entries(counts).filter(([, n]) => n > 0).map(([status, n]) => [status, number(n)]));
  section("Jobs", "The doubtful ones first: look at these. A name opens the job's own page.", table([
    { name: "Job", key: "name", text: true, show: (name, j) => (j.page ? el("a", { href: j.page.split("/").map(encodeURIComponent).join("/") }, name) : name) },
    { name: "Command", key: "command", text: true, show: String }, { name: "Status", key: "status", text: true, show: String },
    { name: "Cost", key: "cost", show: (v) => (v == null ? "" : number(v, 4)) }, { name: "Expected error", key: "expected_error_mm", show: (v) => (v == null ? "" : mm(v)) },
    { name: "Time", key: "time_s", show: (v) => (v == null ? "" : seconds(v)) }, { name: "Why", value: (j) => j.reasons.join("; "), text: true, long: true, show: String }],
  report.jobs, (j) => j.status !== "ok"));
  manifest(report);
}

({ batch: batchPage, register: registerPage, scene: scenePage, study: studyPage, compare: comparePage, bench: benchPage, track: trackPage })[data.kind](data);
document.title = root.querySelector("h1").textContent + " · raylign";
