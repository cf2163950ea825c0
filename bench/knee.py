#!/usr/bin/env python3
"""Registers the two components of a real knee replacement in one plane, from many starts near an expert's poses.

    bench/knee.py RAYLIGN KNEE -o FOLDER [--starts N] [--ranks N] [--json FILE] [-- OPTIONS ...]

KNEE has the frames, models, poses and the calibration of JTML's example Kneel_1 (AT_K1_V1_0160.tif and ..0170.tif,
KR_right_7_fem.stl, KR_right_6_tib.stl, fem.jts, tib.jts, calibration.txt). The starts lie within 10 mm and 10 degrees
of the expert's poses: the model's centre is moved to a random place of a ball, and turned about a random axis. The jobs
run by `raylign batch`, so that a run that was stopped goes on; OPTIONS are options of `register` as NAME=VALUE.
Success: in plane (across the line of sight to the model's centre) below 0.5 mm and turned by less than 2 degrees from
the expert's pose, which is no gold standard (its depth is known to several mm).
"""

import argparse
import csv
import datetime
import json
import math
import pathlib
import platform
import random
import statistics
import subprocess
import sys

PARTS = {"fem": ("KR_right_7_fem.stl", "cobalt-chrome"), "tib": ("KR_right_6_tib.stl", "titanium")}
FRAMES = {1: "AT_K1_V1_0160.tif", 2: "AT_K1_V1_0170.tif"}
MOST_MM, MOST_DEG = 10, 10
IN_PLANE_MM, TURN_DEG = 0.5, 2


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def transposed(a):
    return [list(row) for row in zip(*a)]


def rotation(axis, angle_rad):
    x, y, z = axis
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    v = 1 - c
    return [[c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v]]


def direction(generator):
    while True:
        v = [generator.uniform(-1, 1) for _ in range(3)]
        length = math.sqrt(sum(x * x for x in v))
        if 0.1 < length <= 1:
            return [x / length for x in v]


def turn_of(matrix):
    return [row[:3] for row in matrix[:3]]


def moved(matrix, point):
    return [sum(matrix[i][k] * point[k] for k in range(3)) + matrix[i][3] for i in range(3)]


def centre_of(stl):
    """Of the box around an ASCII STL."""
    words = (line.split() for line in stl.read_text().splitlines())
    corners = [[float(word) for word in line[1:]] for line in words if line and line[0] == "vertex"]
    return [(min(values) + max(values)) / 2 for values in zip(*corners)]


def start_near(pose, centre_ct, generator):
    """T(c) R T(-c) pose, c moved on."""
    turn = rotation(direction(generator), math.radians(generator.uniform(0, MOST_DEG)))
    shift = [generator.uniform(0, 1) ** (1 / 3) * MOST_MM * x for x in direction(generator)]
    centre = moved(pose, centre_ct)
    turned = product(turn, turn_of(pose))
    at = [sum(turned[i][k] * centre_ct[k] for k in range(3)) for i in range(3)]
    return [turned[i] + [centre[i] + shift[i] - at[i]] for i in range(3)] + [[0, 0, 0, 1]]


def errors(found, expert, centre_ct):
    """In plane [mm], in depth [mm], turn [deg]; the source is the world's origin (JointTrack)."""
    a, b = moved(found, centre_ct), moved(expert, centre_ct)
    length = math.sqrt(sum(x * x for x in b))
    difference = [x - y for x, y in zip(a, b)]
    depth = sum(d * x / length for d, x in zip(difference, b))
    plane = math.sqrt(max(0, sum(d * d for d in difference) - depth * depth))
    between = product(turn_of(found), transposed(turn_of(expert)))
    trace = sum(between[i][i] for i in range(3))
    return plane, depth, math.degrees(math.acos(max(-1, min(1, (trace - 1) / 2))))


def expert_pose(raylign, knee, part, frame, folder):
    file = folder / f"{part}{frame}.json"
    subprocess.run([raylign, "poses", knee / f"{part}.jts", "--frame", str(frame), "-o", file], check=True,
                   stdout=subprocess.DEVNULL)
    return json.loads(file.read_text())["world_from_ct"]


def write_jobs(arguments, folder, options):
    knee = arguments.knee.resolve()
    rows, experts, centres = [], {}, {}
    for part, (model, _) in PARTS.items():
        centres[part] = centre_of(knee / model)
    cases = [(part, frame) for part in PARTS for frame in FRAMES]
    generators = {case: random.Random(f"{case[0]} {case[1]}") for case in cases}
    for part, frame in cases:
        experts[part, frame] = expert_pose(arguments.raylign, knee, part, frame, folder)
    for number in range(arguments.starts):
        for part, frame in cases:
            model, material = PARTS[part]
            name = f"{part}{frame}_{number:02}"
            start = start_near(experts[part, frame], centres[part], generators[part, frame])
            (folder / f"{name}.json").write_text(json.dumps({"raylign": 1, "world_from_ct": start}))
            rows.append({"name": name, "volume": knee / model, "start": f"{name}.json", "material": material,
                         "views": f"{knee / 'calibration.txt'}={knee / FRAMES[frame]}", "no-viewer": "yes"} | options)
    with open(folder / "jobs.csv", "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return experts, centres


def row_of(part, frame, arguments, folder, experts, centres):
    reports = []
    for number in range(arguments.starts):
        file = folder / "out" / f"{part}{frame}_{number:02}" / "report.json"
        if file.exists():
            reports.append(json.loads(file.read_text()))
    expert = experts[part, frame]
    ends = [errors(r["world_from_ct"], expert, centres[part]) for r in reports]
    is_right = [plane < IN_PLANE_MM and turn < TURN_DEG for plane, _, turn in ends]
    is_ok = [r["verdict"]["ok"] for r in reports]
    right = [e for e, good in zip(ends, is_right) if good]
    middle = [statistics.median(values) for values in zip(*right)] if right else [math.nan] * 3
    sigma = [r["sigma"] for r, good in zip(reports, is_right) if good and r["sigma"]]
    expected = [statistics.median(s[key] for s in sigma) if sigma else math.nan
                for key in ("in_plane_mm", "in_depth_mm", "rotation_deg")]
    flips = sum(any(rival["rotation_deg"] > 15 for rival in r["search"]["rivals"]) for r in reports)
    for number, (end, good, ok) in enumerate(zip(ends, is_right, is_ok)):
        print(f"{part}{frame}_{number:02}: {end[0]:.2f} mm in plane, {end[1]:+.1f} mm in depth, {end[2]:.2f} deg; "
              f"{'right' if good else 'WRONG'}, {'ok' if ok else 'doubted'}")
    digits = [[round(value, 2) for value in values] for values in (middle, expected)]
    return [PARTS[part][0], FRAMES[frame], [sum(is_right), len(reports)], *digits,
            sum(ok and not good for ok, good in zip(is_ok, is_right)),
            sum(good and not ok for ok, good in zip(is_ok, is_right)), flips,
            round(statistics.median(r["time_s"]["total"] for r in reports), 1)]


def main():
    own = sys.argv[1:]
    extra = own[own.index("--") + 1:] if "--" in own else []
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("raylign")
    parser.add_argument("knee", type=pathlib.Path)
    parser.add_argument("-o", dest="folder", type=pathlib.Path, required=True)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--ranks", type=int, default=1, help="by mpirun")
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args(own[:own.index("--")] if "--" in own else own)
    options = {"content": "part"} | dict(word.split("=", 1) for word in extra)
    arguments.folder.mkdir(parents=True, exist_ok=True)
    experts, centres = write_jobs(arguments, arguments.folder, options)
    ranks = ["mpirun", "--oversubscribe", "-n", str(arguments.ranks)] if arguments.ranks > 1 else []
    subprocess.run([*ranks, arguments.raylign, "batch", arguments.folder / "jobs.csv", "-o", arguments.folder / "out",
                    "--quiet"])
    rows = [row_of(part, frame, arguments, arguments.folder, experts, centres) for part in PARTS for frame in FRAMES]
    for row in rows:
        print(row)
    if arguments.json:
        record(arguments, extra, rows)


def record(arguments, extra, rows):
    processor = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo", encoding="utf-8")
                      if line.startswith("model name")), "unknown processor")
    columns = [("model", "", None), ("frame", "", None), ("right", "registrations", "{} of {}"),
               ("from the expert's pose, median of the right ones: in plane, in depth, turn", "mm, mm, deg",
                "{} mm, {} mm, {} deg"),
               ("expected: in plane, in depth, turn", "mm, mm, deg", "{} mm, {} mm, {} deg"),
               ("wrong and ok", "registrations", None), ("right and doubted", "registrations", None),
               ("a rival turned by more than 15 degrees is named", "registrations", None), ("s, p50", "s", None)]
    text = {"title": "A real knee replacement in one plane", "date": datetime.date.today().isoformat(),
            "machine": f"{processor}, {platform.system()} {platform.release()}", "compiler": "g++ 12.2 -O3",
            "command": f"knee.py RAYLIGN KNEE --starts {arguments.starts} {'-- ' if extra else ''}{' '.join(extra)}".strip(),
            "notes": "right: in plane below 0.5 mm and turned by less than 2 degrees from the expert's pose",
            "columns": [{"name": name, "unit": unit} | ({"format": how} if how else {}) for name, unit, how in columns],
            "rows": rows}
    arguments.json.write_text(json.dumps(text, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
