"""The spine phantom: a volume of 64^3 voxels and two X-rays of 96^2 pixels, taken of the phantom itself."""

import os
import signal
import sys
import types
from pathlib import Path

import numpy as np
import pytest

import raylign

sys.path.insert(0, str(Path(__file__).parents[2] / "apps/python/examples"))
signal.signal(signal.SIGINT, signal.default_int_handler)  # shells have what runs in the background ignore Ctrl-C


def c_arm(name, primary_deg, side_px=96):
    pitch_mm = 1.5 * 200 / side_px
    return raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(side_px, side_px), pixel_pitch_mm=(pitch_mm, pitch_mm),
                              primary_deg=primary_deg)


def moved(pose, x=0.0, y=0.0, z=0.0):
    step = np.eye(4)
    step[:3, 3] = x, y, z
    return step @ pose


@pytest.fixture(scope="session")
def spine():
    volume = raylign.phantom_volume("spine", 160, 64)
    turn = np.deg2rad(5)
    truth = np.array([[np.cos(turn), -np.sin(turn), 0, 3], [np.sin(turn), np.cos(turn), 0, -4], [0, 0, 1, 2], [0, 0, 0, 1.0]])
    xrays = [raylign.phantom_xray("spine", 160, view, truth, 1e6, seed)
             for seed, view in enumerate([c_arm("AP", 0), c_arm("LAT", 90)], start=1)]
    targets = raylign.default_targets(volume)
    return types.SimpleNamespace(
        volume=volume, views=xrays, truth=truth, targets=targets,
        start=raylign.perturbed_start(truth, targets, 8, 3),
        error_mm=lambda pose: raylign.target_errors(pose, truth, targets)["mtre_mm"],
        xrays=lambda pose: [raylign.phantom_xray("spine", 160, view, pose, 1e5, seed)
                            for seed, view in enumerate([c_arm("AP", 0), c_arm("LAT", 90)], start=1)])


@pytest.fixture(scope="session")
def program():
    """Where the program `raylign` of this build is."""
    path = os.environ.get("RAYLIGN_PROGRAM")
    if not path:
        pytest.skip("the program is not part of this build")
    return path
