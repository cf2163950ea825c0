// tests/install/example/track.cpp
#include <cstdio>

#include "scene.h"

int main() {
    using namespace raylign;
    Patient patient;
    const std::unique_ptr<Backend> backend = create_backend("auto").backend;
    const RigidTransform start = perturbed_start(patient.truth, patient.targets, 3.0, 1);

    // CT and backend are borrowed for the tracker's life.
    Tracker tracker(patient.ct, start, {}, *backend);
    bool all_found = true;
    for (int number = 1; number <= 6; ++number) {
        if (number == 4) {
            all_found = all_found && tracker.skip(number, "the camera lost it").status == TrackStatus::missing;
            continue;
        }
        patient.truth = RigidTransform::translate({4 + 1.5 * number, -3, 2 - 0.8 * number});
        patient.take_xrays(patient.truth);
        const TrackFrame frame = tracker.feed(number, patient.views);
        std::printf("frame %d: %s, %.2f mm from where it was expected, error %.2f mm\n", number,
                    std::string(status_name(frame.status)).c_str(), frame.jump_mm,
                    patient.error_mm(frame.world_from_ct));
        all_found = all_found && frame.status == TrackStatus::ok && patient.error_mm(frame.world_from_ct) < 1.25;
    }
    return all_found ? 0 : 1;
}
