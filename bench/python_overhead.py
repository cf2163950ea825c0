"""What a call of Session.evaluate costs from Python: median microseconds for one pose of a scene that is next to nothing (8^3 voxels,
two views of 8^2 pixels), so that nearly all of it is the call. Prints JSON."""

import json
import time

import numpy as np

import raylign

CALLS = 2000


def main() -> None:
    volume = raylign.phantom_volume("box", extent_mm=160, size=8)
    views = [raylign.phantom_xray("box", 160, raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(8, 8), pixel_pitch_mm=(36, 36),
                                                                 primary_deg=degrees), np.eye(4))
             for name, degrees in (("AP", 0), ("LAT", 90))]
    session = raylign.Session(volume, views, raylign.Backend("cpu", threads=1))
    pose, times = np.eye(4), []
    for _ in range(CALLS):
        begin = time.perf_counter()
        session.evaluate(pose)
        times.append(time.perf_counter() - begin)
    print(json.dumps({"calls": CALLS, "median_us": round(1e6 * float(np.median(times)), 1),
                      "p95_us": round(1e6 * float(np.quantile(times, 0.95)), 1)}))


if __name__ == "__main__":
    main()
