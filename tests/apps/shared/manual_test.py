#!/usr/bin/env python3
"""What the manual has its readers save and type must run as the pages say.

    manual_test.py RAYLIGN WORK_FOLDER

Runs the `sh` blocks of the pages in order, each page in a folder with the files that it names and the data that its readers bring (a CT, two
X-rays). A block that ends otherwise than by 0, or than `# exits N` says, fails; so does one of the ten usual mistakes (those that
take seconds) that ends otherwise than the table says. Python blocks run where the package raylign can be imported.
"""

import array
import copy
import gzip
import json
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "docs/site"))
import pages  # noqa: E402

NAMES = ["start", "geometry", "trust", "coming_from"]
DOCS = pages.ROOT / "docs"
WATER_PER_MM = 0.0193


def voxels_of(path):
    """Header and voxels of an .mha of floats, as `phantom` writes it."""
    data = path.read_bytes()
    begin = data.index(b"\n", data.index(b"ElementDataFile")) + 1
    return data[:begin], array.array("f", data[begin:])


def write_ct_in_hu(path, header, voxels):
    """NIfTI-1, int16, its axes those of the phantom: LPS there, RAS here."""
    size, spacing, offset = (
        [float(x) for x in re.search(rb"%s = (.*)" % key, header)[1].split()] for key in (b"DimSize", b"ElementSpacing", b"Offset"))
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *(int(n) for n in size), 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 4, 16)
    struct.pack_into("<8f", head, 76, 1, *spacing, 1, 1, 1, 1)
    struct.pack_into("<3f", head, 108, 352, 1, 0)
    head[123] = 2  # mm
    struct.pack_into("<h", head, 254, 1)
    for row, sign in enumerate((-1, -1, 1)):
        line = [0, 0, 0, sign * offset[row]]
        line[row] = sign * spacing[row]
        struct.pack_into("<4f", head, 280 + 16 * row, *line)
    head[344:348] = b"n+1\0"
    hu = array.array("h", (round(1000 * (mu / WATER_PER_MM - 1)) for mu in voxels))
    with gzip.open(path, "wb", compresslevel=1) as file:
        file.write(bytes(head) + hu.tobytes())


class Manual:
    def __init__(self, program, work):
        self.environment = {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}"}
        self.work, self.faults, self.count = work, [], 0
        self.has_package = self.python("import raylign", work).returncode == 0

    def sh(self, code, folder):
        return subprocess.run(["bash", "-ec", code], cwd=folder, env=self.environment, capture_output=True, text=True, timeout=120)

    def python(self, code, folder):
        return subprocess.run([sys.executable, "-c", code], cwd=folder, env=self.environment, capture_output=True, text=True, timeout=120)

    def page(self, name):
        folder = self.work / name
        folder.mkdir()
        if name == "start":
            self.bring_own_data(folder)
        for kind, what, more in pages.steps((DOCS / f"{name}.md").read_text(encoding="utf-8")):
            if kind == "file":
                (folder / what).write_text(more)
            elif kind == "picture" and not (folder / what).is_file():
                self.faults.append(f"{name}.md: nothing before the picture {what} makes it")
            elif kind == "sh":
                self.expect(f"{name}.md", what, self.sh(what, folder), more)
            elif kind == "python" and self.has_package:
                self.expect(f"{name}.md", what, self.python(what, folder), 0)

    def expect(self, where, what, done, code):
        self.count += 1
        if done.returncode != code:
            self.faults.append(f"{where}: ended with {done.returncode} instead of {code}:\n{what}{done.stdout[-2000:]}{done.stderr[-2000:]}")

    def bring_own_data(self, folder):
        """The CT and the X-rays that a reader of start.md has: those of the page's own practice."""
        data = self.work / "data"
        data.mkdir()
        for kind, what, more in pages.steps((DOCS / "start.md").read_text(encoding="utf-8")):
            if kind == "file":
                (data / what).write_text(more)
        self.sh("raylign phantom spine --size 96 --spacing 2 -o spine.mha", data)
        self.sh("raylign drr -v spine.mha --attenuation --views geometry.json --pose truth.json --xray c-arm -o xrays", data)
        write_ct_in_hu(folder / "ct.nii.gz", *voxels_of(data / "spine.mha"))
        shutil.copy(data / "xrays/drr_AP.tif", folder / "ap.tif")
        shutil.copy(data / "xrays/drr_LAT.tif", folder / "lat.tif")

    def mistakes(self):
        """Rows of the table that say 1 or 2, in the folder of geometry.md, which has the phantom and its X-rays. The page itself tries row 2."""
        folder = self.work / "geometry"
        text = (DOCS / "geometry.md").read_text(encoding="utf-8")
        said = {row[1]: int(row[2]) for row in re.finditer(r"^\| (\d+) \| [^|]* \| ([12]) \|", text, re.M)}
        made = mistakes_of(folder)
        for row, variants in made.items():
            for i, (volume, views) in enumerate(variants):
                (folder / f"mistake_{row}_{i}.json").write_text(json.dumps({"raylign": 1, "views": views}))
                code = f"raylign register -v {volume} --attenuation --views mistake_{row}_{i}.json -o mistake --quiet"
                self.expect(f"geometry.md, mistake {row}", code + "\n", self.sh(code, folder), said[row])


def mistakes_of(folder):
    """Row of the table: ways to make it, each a volume and views."""
    right = json.loads((folder / "mirrored.json").read_text())["views"]
    del right[0]["flip"]

    def changed(change, which=(0, 1)):
        views = copy.deepcopy(right)
        for i in which:
            change(views[i])
        return views

    def arm(**values):
        return lambda view: view["c_arm"].update(values)

    header, voxels = voxels_of(folder / "spine.mha")
    metres = re.sub(rb"ElementSpacing = .*", b"ElementSpacing = 0.002 0.002 0.002", header)
    (folder / "metres.mha").write_bytes(metres + voxels.tobytes())
    ct = "spine.mha"
    return {
        "3": [(ct, changed(arm(sad_mm=1500, sdd_mm=1000)))],
        "5": [("metres.mha", right), (ct, changed(arm(sad_mm=1, sdd_mm=1.5, pixel_pitch_mm=[0.0015, 0.0015])))],
        "6": [(ct, changed(arm(principal_point_px=[105.5, 95.5]), (0,)))],
        "7": [(ct, changed(arm(primary_angle_deg=-90), (1,)))],
        "8": [(ct, changed(lambda view: view.update(flip="rows")))],
    }


def main():
    program, work = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    manual = Manual(program, work)
    for name in NAMES:
        manual.page(name)
    manual.mistakes()
    if manual.faults:
        sys.exit("The manual and the program disagree:\n" + "\n".join(manual.faults))
    print(f"{manual.count} blocks and mistakes run as the pages say" + ("" if manual.has_package else "; no Python package here"))


if __name__ == "__main__":
    main()
