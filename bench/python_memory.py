"""What memory a volume takes on its way from an array through raylign: MiB by which the peak of the process rises at each step, beside
the bytes that must be there. python_memory.py [SLICES ROWS COLUMNS], 256 each by default. Prints JSON."""

import json
import sys

import numpy as np

import raylign

MIB = 1 << 20


def peak_mib() -> float:
    """Of this process, since it began (Linux)."""
    with open("/proc/self/status") as file:
        return int(next(line for line in file if line.startswith("VmHWM")).split()[1]) / 1024


def views() -> list[raylign.View]:
    return [raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(256, 256), pixel_pitch_mm=(1.5, 1.5), primary_deg=degrees)
            for name, degrees in (("AP", 0), ("LAT", 90))]


def main() -> None:
    steps, last = {}, 0.0

    def told(name: str, **must: int) -> None:
        nonlocal last
        now = peak_mib()
        steps[name] = {"rise_mib": round(now - last, 1), **{key: round(value / MIB, 1) for key, value in must.items()}}
        last = now

    raylign.Session(raylign.phantom_volume("box", 160, 8), views(), "cpu").render(np.eye(4))  # what is loaded and made once
    shape = tuple(map(int, sys.argv[1:])) or (256, 256, 256)
    told("begin")
    array = np.zeros(shape, np.int16)
    array += 40
    told("array of int16", array_mib=array.nbytes)
    volume = raylign.Volume(array, (1, 1, 1), -np.array(shape[::-1]) / 2)
    told("Volume", floats_mib=4 * array.size)
    volume.attenuation.max()
    told("attenuation")
    session = raylign.Session(volume, views(), "cpu")
    session.render(np.eye(4))
    told("Session, one DRR", copy_of_the_backend_mib=session.volume_bytes)
    session.with_views(views()).render(np.eye(4), 1)
    told("with_views, another DRR", copy_of_the_backend_mib=session.volume_bytes)
    print(json.dumps(steps, indent=1))


if __name__ == "__main__":
    main()
