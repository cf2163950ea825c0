// Registers a phantom to two simulated X-rays with the installed library, in memory, without any file.
#include <cstdio>
#include <vector>

#include "raylign/backends.h"
#include "raylign/phantom.h"
#include "raylign/registration.h"
#include "raylign/targets.h"

int main() {
    using namespace raylign;
    const Phantom phantom = spine_phantom({120, 120, 120});
    const Volume volume = voxelise(phantom, centred_grid({48, 48, 48}, {2.5, 2.5, 2.5}));

    const CArm frontal{.sad_mm = 1000, .sdd_mm = 1500, .pixel_pitch_mm = {3, 3}, .size_px = {64, 64}};
    CArm lateral = frontal;
    lateral.primary_angle_deg = 90;
    std::vector<View> views{{"AP", view_from_c_arm(frontal), {}, {}}, {"LAT", view_from_c_arm(lateral), {}, {}}};

    const RigidTransform truth;  // world_from_ct: here the CT's frame is the world's
    for (View& view : views) view.image = exact_drr(phantom, view.geometry, truth);

    const auto targets = default_targets_ct_mm(volume);
    const RigidTransform start = perturbed_start(truth, targets, 5.0, 1);
    const BackendChoice choice = create_backend("auto");
    const RegistrationResult result = register_volume(volume, views, start, {}, *choice.backend);

    const double before_mm = mean_target_error_mm(start, truth, targets);
    const double after_mm = mean_target_error_mm(result.world_from_ct, truth, targets);
    std::printf("%s: mTRE %.2f mm -> %.2f mm\n", choice.backend->info().name.c_str(), before_mm, after_mm);
    return result.ok && after_mm < 1.25 ? 0 : 1;  // half a voxel
}
