"""An optimizer of one's own on raylign's costs and derivatives: Gauss-Newton with a halved step where the cost rises."""

import numpy as np

import raylign


def gauss_newton(session: raylign.Session, pose: np.ndarray, steps: int = 20) -> np.ndarray:
    for _ in range(steps):
        costs, gradients, curvatures = session.linearize(pose)
        twist = -np.linalg.solve(curvatures[0], gradients[0])
        tried = raylign.move(pose, twist * 0.5 ** np.arange(4)[:, None], session.centre)
        found = session.evaluate(tried)  # a batch: one call for all four
        if found.min() >= costs[0]:
            break
        pose = tried[found.argmin()]
    return pose


def main() -> None:
    volume = raylign.phantom_volume("spine", extent_mm=160, size=64)
    truth = raylign.perturbed_start(np.eye(4), raylign.default_targets(volume), 5, seed=1)
    views = []
    for name, degrees in (("AP", 0), ("LAT", 90)):
        view = raylign.View.c_arm(name, sad_mm=1000, sdd_mm=1500, size_px=(96, 96), pixel_pitch_mm=(3, 3), primary_deg=degrees)
        views.append(raylign.phantom_xray("spine", 160, view, truth))
    targets = raylign.default_targets(volume)
    start = raylign.perturbed_start(truth, targets, 2, seed=2)
    session = raylign.Session(volume, views)
    pose = gauss_newton(session, start)
    for name, at in (("start", start), ("end", pose)):
        error_mm = raylign.target_errors(at, truth, targets)["mtre_mm"]
        print(f"{name}: cost {session.evaluate(at)[0]:.4f}, {error_mm:.2f} mm from the truth")


if __name__ == "__main__":
    main()
