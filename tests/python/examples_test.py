import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import raylign

EXAMPLES = Path(__file__).parents[2] / "apps/python/examples"


def run(name, *arguments, expected=0):
    done = subprocess.run([sys.executable, EXAMPLES / name, *map(str, arguments)], capture_output=True, text=True, env=os.environ)
    assert done.returncode == expected, done.stderr
    return done.stdout


def test_an_optimizer_of_ones_own():
    start, end = re.findall(r"([\d.]+) mm from the truth", run("own_optimizer.py"))
    assert float(start) == 2 and float(end) < 0.5


def test_a_study_with_ones_own_x_rays():
    last = run("own_study.py").splitlines()[-1]
    assert float(re.search(r"median ([\d.]+) mm", last)[1]) < 0.6 and "100% below 1 mm" in last, last


def test_from_files_to_a_pose(spine, tmp_path, program):
    """Two C-arm views as the program simulates and registers them: the package ends at the same pose, bit for bit."""
    raylign.write_volume(tmp_path / "ct.mha", spine.volume)
    raylign.write_pose(tmp_path / "truth.json", spine.truth)
    c_arm = {"sad_mm": 1000, "sdd_mm": 1500, "pixel_pitch_mm": [3, 3], "size_px": [96, 96]}
    views = [{"name": name, "c_arm": {**c_arm, "primary_angle_deg": degrees, "secondary_angle_deg": 0}} for name, degrees in (("AP", 0), ("LAT", 90))]
    (tmp_path / "geometry.json").write_text(json.dumps({"raylign": 1, "views": views}))
    ct = ["-v", tmp_path / "ct.mha", "--attenuation"]

    def raylign_program(*arguments):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr

    raylign_program("drr", *ct, "--views", tmp_path / "geometry.json", "--pose", tmp_path / "truth.json", "-o", tmp_path / "xrays")
    raylign_program("register", *ct, "--views", tmp_path / "xrays/views.json", "-o", tmp_path / "out")
    said = run("register_files.py", tmp_path / "ct.mha", "--attenuation", tmp_path / "xrays/views.json", "-o", tmp_path / "pose.json")
    assert "registered" in said
    written = np.array(json.loads((tmp_path / "out/pose.json").read_text())["world_from_ct"])
    by_example = np.array(json.loads((tmp_path / "pose.json").read_text())["world_from_ct"])
    assert np.array_equal(by_example, written)
    here = raylign.register(raylign.read_volume(tmp_path / "ct.mha", is_attenuation=True), tmp_path / "xrays/views.json")
    assert np.array_equal(here.world_from_ct, written)
    # From a start of one's own, too: it goes through a file there and through an array here.
    raylign.write_pose(tmp_path / "start.json", spine.start)
    raylign_program("register", *ct, "--views", tmp_path / "xrays/views.json", "--start", tmp_path / "start.json", "-o", tmp_path / "started")
    started = np.array(json.loads((tmp_path / "started/pose.json").read_text())["world_from_ct"])
    for start in (tmp_path / "start.json", raylign.read_pose(tmp_path / "start.json")):
        assert np.array_equal(raylign.register(spine.volume, tmp_path / "xrays/views.json", start).world_from_ct, started)
