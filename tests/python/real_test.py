"""A real chest CT: the program and the package, on files, arrays and images of nibabel, end at the same pose, bit for bit."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import raylign

DATA = Path(os.environ.get("RAYLIGN_TEST_DATA", Path(__file__).parents[3] / "shared/data"))
CHEST = DATA / "chest/lidc-0314-half.nii.gz"


@pytest.fixture(scope="module")
def chest(tmp_path_factory, program):
    """Two X-rays, simulated by the program with noise, and its registration of them."""
    if not CHEST.exists():
        assert "RAYLIGN_REQUIRE_DATA" not in os.environ, f"missing test data: {CHEST}"
        pytest.skip(f"missing test data: {CHEST}")
    folder = tmp_path_factory.mktemp("chest")
    ct = raylign.read_volume(CHEST)
    truth = np.eye(4)
    truth[:3, 3] = -ct.centre
    truth = raylign.perturbed_start(truth, raylign.default_targets(ct), 20, seed=5)
    raylign.write_pose(folder / "truth.json", truth)
    raylign.write_pose(folder / "start.json", raylign.perturbed_start(truth, raylign.default_targets(ct), 8, seed=1))
    c_arm = {"sad_mm": 1000, "sdd_mm": 1500, "pixel_pitch_mm": [3.125, 3.125], "size_px": [192, 192], "secondary_angle_deg": 0}
    views = [{"name": name, "c_arm": {**c_arm, "primary_angle_deg": degrees}} for name, degrees in (("AP", 0), ("LAT", 90))]
    (folder / "geometry.json").write_text(json.dumps({"raylign": 1, "views": views}))

    def run(*arguments):
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, cwd=folder)
        assert done.returncode == 0, done.stdout + done.stderr

    run("drr", "-v", CHEST, "--views", "geometry.json", "--pose", "truth.json", "--xray", "c-arm", "--seed", 7, "-o", "xrays")
    run("register", "-v", CHEST, "--views", "xrays/views.json", "--start", "start.json", "--backend", "cpu", "-o", "out")
    return folder, truth


def test_the_programs_pose_bit_for_bit(chest):
    folder, truth = chest
    written = np.array(json.loads((folder / "out/pose.json").read_text())["world_from_ct"])
    report = json.loads((folder / "out/report.json").read_text())
    ct = raylign.read_volume(CHEST)
    by_files = raylign.register(ct, folder / "xrays/views.json", folder / "start.json", backend="cpu")
    by_array = raylign.register(raylign.Volume(ct.attenuation, ct.spacing, ct.origin, ct.direction, unit="1/mm"),
                                raylign.read_views(folder / "xrays/views.json"), raylign.read_pose(folder / "start.json"), backend="cpu")
    for found in (by_files, by_array):
        assert np.array_equal(found.world_from_ct, written)
        assert found.cost_final == report["cost"]["final"] and found.ok
    assert raylign.target_errors(written, truth, raylign.default_targets(ct))["mtre_mm"] < 0.5
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.load(CHEST)
    by_image = raylign.Volume.from_image(image)
    assert np.array_equal(by_image.attenuation, ct.attenuation) and not image.in_memory
