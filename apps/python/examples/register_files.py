"""From a CT (a DICOM folder, NIfTI, ...) and X-rays to a pose: register_files.py CT VIEWS [VIEWS ...] [-o pose.tfm]"""

import argparse
import sys

import raylign


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("ct")
    arguments.add_argument("views", nargs="+", help="views.json, or geometry files as FILE=IMAGE; a DICOM X-ray is its own image")
    arguments.add_argument("--attenuation", action="store_true", help="the CT's voxels are 1/mm already")
    arguments.add_argument("--start", help="pose.json, .tfm or .dcm")
    arguments.add_argument("-o", "--output", default="pose.tfm", help="for 3D Slicer and ITK")
    given = arguments.parse_args()

    volume = raylign.read_volume(given.ct, is_attenuation=given.attenuation)
    for note in volume.notes:
        print("note:", note)
    try:
        result = raylign.register(volume, given.views, given.start)
    except raylign.Interrupted as stopped:  # Ctrl-C: the best until then
        result = stopped.result
    print(result)
    raylign.write_pose(given.output, result.world_from_ct)
    return 0 if result.ok else 1


if __name__ == "__main__":
    sys.exit(main())
