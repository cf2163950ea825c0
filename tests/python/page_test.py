import importlib.util
import json
import re
from pathlib import Path

import numpy as np
import pytest

import raylign

PAGE = Path(__file__).parents[2] / "docs/python.md"


def test_the_pages_snippets_run(spine, tmp_path, monkeypatch, capsys):
    """In order and in one namespace, as a reader would type them, beside a CT in HU and views.json."""
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, 48)] * 3, indexing="ij")
    hu = np.where(x**2 + 2 * y**2 + 3 * z**2 < 0.4, 400, np.where(x**2 + y**2 + z**2 < 0.8, 0, -1000)).astype(np.int16)
    ct = raylign.Volume(hu, (3, 3, 3), (-70.5, -70.5, -70.5))
    nibabel = pytest.importorskip("nibabel")
    nibabel.save(nibabel.Nifti1Image(hu.transpose(2, 1, 0), np.array([[-3, 0, 0, 70.5], [0, -3, 0, 70.5], [0, 0, 3, -70.5], [0, 0, 0, 1]])),
                 "ct.nii.gz")
    c_arm = {"sad_mm": 1000, "sdd_mm": 1500, "pixel_pitch_mm": [3, 3], "size_px": [96, 96], "secondary_angle_deg": 0}
    views = [raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(96, 96), pixel_pitch_mm=(3, 3), primary_deg=degrees)
             for name, degrees in (("AP", 0), ("LAT", 90))]
    truth = np.eye(4)
    truth[:3, 3] = 3, -2, 4
    stored = []
    for view, degrees in zip(views, (0, 90)):
        image = raylign.drr(ct, [view], truth)[0, 0]
        write_mha(tmp_path / f"{view.name}.mha", image)
        stored.append({"name": view.name, "image": f"{view.name}.mha", "intensity": {"kind": "line-integral"},
                       "c_arm": {**c_arm, "primary_angle_deg": degrees}})
    Path("views.json").write_text(json.dumps({"raylign": 1, "views": stored}))

    scope = {}
    for snippet in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.S):
        if snippet.startswith("import torch") and importlib.util.find_spec("torch") is None:
            continue  # optional, and large
        exec(compile(snippet, str(PAGE), "exec"), scope)
    assert raylign.target_errors(scope["result"].world_from_ct, truth, raylign.default_targets(ct))["mtre_mm"] < 0.5
    assert "start: must have the shape (4, 4), has (3, 3)" in capsys.readouterr().out


def write_mha(path, image):
    header = (f"ObjectType = Image\nNDims = 2\nDimSize = {image.shape[1]} {image.shape[0]}\nElementType = MET_FLOAT\n"
              "BinaryData = True\nBinaryDataByteOrderMSB = False\nElementDataFile = LOCAL\n")
    path.write_bytes(header.encode() + image.astype("<f4").tobytes())
