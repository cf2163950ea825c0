"""A study with X-rays of one's own: how far off the ends are, trial by trial, as records that pandas takes."""

import numpy as np

import raylign

PHOTONS_PER_PIXEL = 2000


def noisy(line_integrals: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """What a detector would count, with a fog of 10 %: whatever your machine does, do here."""
    counts = random.poisson(PHOTONS_PER_PIXEL * (np.exp(-line_integrals) + 0.1 * np.exp(-line_integrals).mean()))
    return raylign.line_integral(np.maximum(counts, 1).astype(np.uint16), i0=PHOTONS_PER_PIXEL)[0]


def main(trials: int = 5) -> None:
    volume = raylign.phantom_volume("spine", extent_mm=160, size=64)
    targets = raylign.default_targets(volume)
    geometry = [raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(96, 96), pixel_pitch_mm=(3, 3), primary_deg=degrees)
                for name, degrees in (("AP", 0), ("LAT", 90))]
    records, random = [], np.random.default_rng(1)
    for trial in range(trials):
        truth = raylign.perturbed_start(np.eye(4), targets, 10, seed=100 + trial)
        views = [raylign.phantom_xray("spine", 160, view, truth) for view in geometry]
        for view in views:
            view.image = noisy(view.image, random)
        start = raylign.perturbed_start(truth, targets, 8, seed=trial)
        result = raylign.register(volume, views, start)
        records.append({"trial": trial, "start_mm": 8.0, "error_mm": raylign.target_errors(result.world_from_ct, truth, targets)["mtre_mm"],
                        "expected_mm": result.expected_error_mm, "ok": result.ok, "time_s": result.time_s})
    for record in records:  # or pandas.DataFrame(records)
        print("  ".join(f"{key} {value:.3f}" if isinstance(value, float) else f"{key} {value}" for key, value in record.items()))
    errors = np.array([record["error_mm"] for record in records])
    print(f"median {np.median(errors):.2f} mm, {np.mean(errors < 1):.0%} below 1 mm")


if __name__ == "__main__":
    main()
