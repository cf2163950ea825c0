#!/usr/bin/env python3
"""What raylign writes and what docs/formats.md says must be the same.

    formats_doc_test.py RAYLIGN docs/formats.md WORK_FOLDER

Runs every command on small inputs. Fails listing the keys, columns and files that the page does not name in backticks,
and the keys that the page names and no run has written.
"""

import csv
import json
import pathlib
import re
import shutil
import subprocess
import sys

# Written in some cases only, none of which is made here.
RARE = {
    "report.json": {"decisions", "verdict.reasons"},
    "report.json of several objects": {"decisions", "objects[].sigma", "objects[].search.rivals"},
    "study.json": {"left_out[].backend", "left_out[].reason"},
    "bench.json": {"left_out[].backend", "left_out[].reason"},
    "info --json": {"backends[].devices", "backends[].instruction_sets"},  # a build may lack the backends that have them
}
PERCENTILES = {"p50", "p75", "p95", "p99", "max"}
VIEWS = ["AP", "LAT"]


class Page:
    """The page's sections: names in backticks, and those in the first column of tables."""

    def __init__(self, path):
        self.ticks, self.rows = {}, {}
        section = None
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.startswith("#"):
                section = line.lstrip("#").strip().replace("`", "")
                self.ticks[section], self.rows[section] = set(), []
                continue
            if section is None:
                continue
            self.ticks[section].update(re.findall(r"`([^`]+)`", line))
            if line.startswith("| `"):
                self.rows[section] += re.findall(r"`([^`]+)`", line.split("|")[1])

    def shared(self):
        return self.ticks["Objects that several files share"]


def leaves(value, path=""):
    """Paths of everything that holds no further keys: "levels[].cost.final"."""
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from leaves(inner, path + "." + key if path else key)
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        for item in value:
            yield from leaves(item, path + "[]")
    else:
        yield path


def as_documented(path):
    """Intervals of a study have the keys of all of its trials together."""
    inner = re.fullmatch(r"cases\[\]\.intervals\[\]\.(?!low_mm$|high_mm$)(.+)", path)
    return "cases[].overall." + inner[1] if inner else path


def as_column(name):
    """Columns whose names depend on the case."""
    name = re.sub(r"^cost_(" + "|".join(VIEWS) + r")$", "cost_VIEW", name)
    name = re.sub(r"^angle_[123]_[xyz]_deg$", "angle_N_AXIS_deg", name)
    return re.sub(r"^world_from_ct_[0-2][0-3]$", "world_from_ct_RC", name)


class Check:
    def __init__(self, page):
        self.page, self.faults, self.seen = page, [], {}

    def is_named(self, path, section):
        names = self.page.ticks[section] | self.page.shared()
        parent, _, last = path.rpartition(".")
        if last in PERCENTILES and parent and last in self.page.shared():
            path = parent
        above = (path + ".", path + "[].")  # an empty list or object has no keys of its own
        return path in names or path + "[]" in names or any(name.startswith(above) for name in names)

    def keys(self, section, paths):
        if section not in self.page.ticks:
            self.faults.append(f"no section \"{section}\"")
            return
        for path in sorted({as_documented(p) for p in paths}):
            self.seen.setdefault(section, set()).add(path)
            if not self.is_named(path, section):
                self.faults.append(f"{section}: `{path}` is written and not named")

    def json(self, section, text):
        value = json.loads(text)
        self.keys(section, leaves(value))
        return value

    def csv(self, section, path):
        with open(path, newline="", encoding="utf-8") as file:
            self.keys(section, map(as_column, next(csv.reader(file))))

    def input_keys(self, section, text):
        """Files that are input, too, have examples instead of a table of paths."""
        named = " ".join(self.page.ticks[section])
        for key in sorted({re.sub(r".*\.", "", p).replace("[]", "") for p in leaves(json.loads(text))}):
            if not re.search(r"(^|\W)" + re.escape(key) + r"(\W|$)", named):
                self.faults.append(f"{section}: `{key}` is written and not named")

    def folder(self, folder, objects=()):
        named = self.page.ticks["What each command reads and leaves"]
        for file in sorted(p.name for p in folder.iterdir()):
            name = re.sub("_(" + "|".join(VIEWS) + r")\.", "_VIEW.", file)
            for one in objects:
                name = re.sub(rf"^{one}\.tra$", "NAME.tra", name)
                name = re.sub(rf"^pose_{one}\.(json|tfm)$", r"pose_NAME.\1", name)
            name = re.sub(r"^joint_[a-z]+_[a-z]+\.csv$", "joint_PROXIMAL_DISTAL.csv", name)
            if name not in named:
                self.faults.append(f"{folder.name}: the file {file} is left and not named")

    def never_written(self, rare):
        for section, seen in self.seen.items():
            for row in self.page.rows[section]:
                path = row.removesuffix("[]")
                below = (path + ".", path + "[].")
                is_seen = any(p.removesuffix("[]") == path or p.startswith(below) for p in seen)
                is_rare = any(path == r or path.startswith((r + ".", r + "[].")) for r in rare.get(section, ()))
                if not is_seen and not is_rare:
                    self.faults.append(f"{section}: `{row}` is named and was never written")


class Runner:
    def __init__(self, program, work):
        self.program, self.work = program, work

    def __call__(self, *arguments, codes=(0,)):
        command = [str(self.program), *map(str, arguments)]
        done = subprocess.run(command, cwd=self.work, capture_output=True, text=True, timeout=120)
        if done.returncode not in codes:
            sys.exit(f"{arguments} ended with {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout


def write_inputs(work):
    c_arm = {"sad_mm": 1000, "sdd_mm": 1500, "secondary_angle_deg": 0, "pixel_pitch_mm": [5, 5], "size_px": [48, 48]}
    views = [{"name": n, "c_arm": {**c_arm, "primary_angle_deg": a}} for n, a in zip(VIEWS, (0, 90))]
    (work / "views.json").write_text(json.dumps({"raylign": 1, "views": views}))
    for name, x_mm in [("pose", 2), ("next", 3), ("last", 4)]:
        matrix = [[1, 0, 0, x_mm], [0, 1, 0, -1], [0, 0, 1, 3], [0, 0, 0, 1]]
        (work / f"{name}.json").write_text(json.dumps({"raylign": 1, "world_from_ct": matrix}))


def check_distortion(run, check, work):
    rows = "[[480, 0, 24], [0, 480, 24], [0, 0, 1]]"
    text = f"image_width: 48\nimage_height: 48\nK: {rows}\nrvec: [0, 0, 0]\nT: [0, 0, 900]\nD: [-0.2, 0.1, 0, 0, 0]\n"
    (work / "camera.yml").write_text("%YAML:1.0\n---\n" + text)
    check.json("geometry --json", run("geometry", "camera.yml", "--json", "-o", "distorted.json"))
    check.input_keys("views.json", (work / "distorted.json").read_text())


def check_register(run, check, work, backend):
    scene = ["-v", "spine.mha", "--attenuation", *backend, "--quiet"]
    run("drr", *scene, "--views", "views.json", "--pose", "pose.json", "--png", "-o", "xrays")
    check.folder(work / "xrays")
    check.input_keys("views.json", (work / "xrays/views.json").read_text())
    run("drr", *scene, "--views", "views.json", "--pose", "pose.json", "--xray", "c-arm", "-o", "counted")
    check.folder(work / "counted")
    check.input_keys("views.json", (work / "counted/views.json").read_text())
    run("register", *scene, "--views", "xrays/views.json", "--truth", "pose.json", "-o", "registered", codes=(0, 1))
    check.folder(work / "registered")
    check.input_keys("Poses", (work / "registered/pose.json").read_text())
    check.json("report.json", (work / "registered/report.json").read_text())
    refine = ["--refine-views", "--view-prior", "1,5", "--start", "pose.json"]
    run("register", *scene, "--views", "xrays/views.json", *refine, "-o", "refined", codes=(0, 1))
    check.folder(work / "refined")
    check.input_keys("views.json", (work / "refined/views_refined.json").read_text())
    check.json("geometry --check --json", run("geometry", "--check", "registered", "refined", "--json"))


def check_rivals(run, check, backend):
    """An ellipsoid looks the same from the other side."""
    run("phantom", "ellipsoid", "--size", 24, "--spacing", 4, "-o", "ellipsoid.mha")
    scene = ["-v", "ellipsoid.mha", "--attenuation", *backend]
    run("drr", *scene, "--views", "views.json", "--pose", "pose.json", "-o", "symmetric")
    search = ["--search", "near", "--search-starts", 200, "--json"]
    report = run("register", *scene, "--views", "symmetric/views.json", *search, "-o", "rivals", codes=(0, 1))
    check.json("report.json", report)


def check_bones(run, check, work, backend):
    run("phantom", "box", "--size", 24, "--spacing", 4, "-o", "box.mha")
    bones = ["--bone", "hip=spine.mha", "--bone", "knee=box.mha", "--attenuation", *backend, "--joint", "hip,knee=9,9"]
    poses = ["--start", "pose.json", "--truth", "hip=pose.json", "--search", "none"]
    run("register", *bones, *poses, "--views", "xrays/views.json", "--quiet", "-o", "bones", codes=(0, 1))
    check.folder(work / "bones", objects=("hip", "knee"))
    check.json("report.json of several objects", (work / "bones/report.json").read_text())
    split = ["-v", "spine.mha", "--attenuation", *backend, "--segment-bones", "--object", "all-bones"]
    run("register", *split, *poses[:2], "--search", "none", "--views", "xrays/views.json", "--quiet", "-o", "split",
        codes=(0, 1))
    names = [line.split(",")[1] for line in (work / "split/bones.csv").read_text().splitlines()]
    check.folder(work / "split", objects=names)


def check_study(run, check, work, backends, threads):
    scene = ["-v", "spine.mha", "--attenuation", "--views", "views.json", "--truth", "pose.json", "--quiet"]
    protocol = ["--bins", "0:4:4", "--per-bin", 1, "--levels", 1, "--backend", ",".join(backends), *threads]
    run("study", *scene, *protocol, "-o", "study")
    check.folder(work / "study")
    check.json("study.json", (work / "study/study.json").read_text())
    check.json("study_starts.json", (work / "study/study_starts.json").read_text())
    check.csv("study.csv", work / "study/study.csv")
    moved = ["--labels", "split/bones.nii.gz", "--labels-table", "split/bones.csv", "--move", "middle_1"]
    run("study", *scene, *moved, "--bins", "0:4:4", "--per-bin", 1, "--backend", backends[0], *threads, "-o", "moved")
    check.json("study.json", (work / "moved/study.json").read_text())
    check.json("study_starts.json", (work / "moved/study_starts.json").read_text())
    check.csv("study.csv", work / "moved/study.csv")
    for folder in ("study", "moved"):
        for line in (work / folder / "study.journal").read_text().splitlines():
            check.json("study.journal", line)


def check_track(run, check, work, backend):
    (work / "frames").mkdir()
    common = ["--attenuation", *backend, "--quiet", "--views", "views.json"]
    for number, pose in enumerate(["pose", "next", "last"], 1):
        run("drr", "-v", "spine.mha", *common, "--pose", f"{pose}.json", "-o", "frame")
        for view in VIEWS:
            shutil.copy(work / f"frame/drr_{view}.tif", work / f"frames/{view}.{number}.tif")
    (work / "frames/LAT.2.tif").unlink()  # a gap
    bones = ["--bone", "hip=spine.mha", "--bone", "knee=spine.mha", "--start", "pose.json", "--joint", "hip,knee"]
    frames = ["--frames", "AP=frames/AP.%d.tif", "--frames", "LAT=frames/LAT.%d.tif"]
    run("track", *common, *bones, *frames, "--recover", "none", "--smooth", "auto", "-o", "track", codes=(1,))
    check.folder(work / "track", objects=("hip", "knee"))
    check.json("track.json", (work / "track/track.json").read_text())
    check.csv("trajectory.csv", work / "track/trajectory.csv")
    run("poses", "track/trajectory.csv", "-o", "poses.csv")
    check.csv("trajectory.csv", work / "poses.csv")
    check.csv("joint_PROXIMAL_DISTAL.csv", work / "track/joint_hip_knee.csv")


def check_batch(run, check, work, backend):
    options = dict(zip((o.removeprefix("--") for o in backend[::2]), map(str, backend[1::2])))
    heading = ["name", "volume", "attenuation", "views", "start", *options]
    rows = [[name, volume, "yes", "xrays/views.json", "pose.json", *options.values()]
            for name, volume in (("one", "spine.mha"), ("none", "nowhere.mha"))]
    (work / "jobs.csv").write_text("".join(",".join(row) + "\n" for row in [heading, *rows]))
    run("batch", "jobs.csv", "--quiet", "-o", "batch", codes=(1,))
    left = {p.name for p in (work / "batch").iterdir()} - {"one.log"}  # progress, where that is slow
    if left != {"batch.csv", "batch.html", "batch.journal", "batch.json", "none.log", "one"}:
        check.faults.append(f"batch leaves {sorted(left)}")
    check.json("batch.json", (work / "batch/batch.json").read_text())


def check_compare_and_bench(run, check, work, backends, threads):
    scene = ["-v", "spine.mha", "--attenuation", "--views", "views.json", "--pose", "pose.json", "--quiet", *threads]
    small = ["--poses", 2, "--longest-side", 32, "--registrations", 1, "--backends", ",".join(backends)]
    run("compare", *scene, *small, "-o", "compared", codes=(0, 1))
    check.folder(work / "compared")
    check.json("compare.json", (work / "compared/compare.json").read_text())
    tiny = ["--size", 16, "--pixels", 32, "--repeat", 1, "--method", "gauss-newton", "--backend", backends[0]]
    run("bench", *tiny, *threads, "--quiet", "-o", "bench", codes=(0, 1))
    check.folder(work / "bench")
    check.json("bench.json", (work / "bench/bench.json").read_text())


def main():
    program, page, work = (pathlib.Path(argument).resolve() for argument in sys.argv[1:4])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    run, check, rare = Runner(program, work), Check(Page(page)), dict(RARE)
    info = check.json("info --json", run("info", "--json"))
    has_cpu = any(b["name"] == "cpu" and b["available"] for b in info["backends"])
    backends = ["cpu", "reference"] if has_cpu else ["reference"]
    threads = ["--threads", 1] if has_cpu else []
    backend = ["--backend", backends[0], *threads]

    write_inputs(work)
    run("phantom", "spine", "--size", 32, "--spacing", 4.5, "-o", "spine.mha")
    check.json("geometry --json", run("geometry", "views.json", "--json", "-o", "written.json"))
    check.input_keys("views.json", (work / "written.json").read_text())
    check_distortion(run, check, work)
    check_register(run, check, work, backend)
    check_bones(run, check, work, backend)
    check_study(run, check, work, backends, threads)
    check_track(run, check, work, backend)
    check_batch(run, check, work, backend)
    if has_cpu:
        check_rivals(run, check, backend)
        check_compare_and_bench(run, check, work, backends, threads)
    else:  # one backend only, and a slow one
        rare["report.json"] = rare["report.json"] | {"search.rivals"}
        rare["study.json"] = rare["study.json"] | {"agreement"}
    # Of `auto`, which may pass over a GPU here or not.
    for section in ("report.json", "report.json of several objects", "track.json"):
        rare[section] = rare.get(section, set()) | {"backend.passed_over"}
    check.never_written(rare)
    if check.faults:
        sys.exit("docs/formats.md and the program disagree:\n" + "\n".join(sorted(set(check.faults))))
    print(f"{sum(map(len, check.seen.values()))} keys and columns of {len(check.seen)} files are named, and no other")


if __name__ == "__main__":
    main()
