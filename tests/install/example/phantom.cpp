// tests/install/example/phantom.cpp
#include <algorithm>
#include <cstdio>

#include "scene.h"

int main() {
    using namespace raylign;
    const Patient patient;

    // A start of a known error. The same seed gives the same start on every machine.
    const RigidTransform start = perturbed_start(patient.truth, patient.targets, 8.0, 42);

    // Errors at the targets: in space, and per view across the rays (what one view can see) and on the detector.
    std::vector<ViewGeometry> geometry;
    for (const View& view : patient.views) geometry.push_back(view.geometry);
    const TargetErrors errors = target_errors(start, patient.truth, patient.targets, geometry);
    const double worst_mm = *std::max_element(errors.tre_mm.begin(), errors.tre_mm.end());
    std::printf("mTRE %.3f mm, worst %.3f mm, mRPD %.3f and %.3f mm\n", errors.mtre_mm, worst_mm, errors.mrpd_mm[0],
                errors.mrpd_mm[1]);

    // The same X-rays as a detector sees them: 20000 photons per open pixel, and noise.
    const Image noisy = with_photon_noise(patient.views[0].image, 20000, 1);

    return errors.mtre_mm > 7.999 && errors.mtre_mm < 8.001 && errors.mean_mrpd_mm < errors.mtre_mm &&
                   noisy.pixels != patient.views[0].image.pixels
               ? 0
               : 1;
}
