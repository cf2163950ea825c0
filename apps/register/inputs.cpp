#include "apps/register/inputs.h"

#include "apps/shared/append.h"
#include "apps/shared/first_guess.h"
#include "apps/shared/interrupt.h"
#include "apps/shared/object_volume.h"
#include "apps/shared/parse.h"
#include "apps/shared/saturation.h"
#include "core/base/clock.h"
#include "core/io/poses/spatial_registration.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/targets.h"

namespace raylign::detail::apps {
namespace {

void read_poses(const TruthFlags& flags, RegisterInputs& inputs) {
    if (!flags.truth.empty()) {
        inputs.true_world_from_ct = read_pose(flags.truth);
        inputs.files.push_back(flags.truth);
    }
    if (!flags.targets.empty()) {
        inputs.targets_ct_mm = read_targets(flags.targets);
        inputs.rotation_centre_ct_mm = targets_centre_mm(inputs.targets_ct_mm);
        inputs.files.push_back(flags.targets);
    }
}

/// The true pose again: where it is in DICOM, which way it goes is told by the CT's frame of reference.
void settle_dicom_poses(const RegisterOptions& options, const std::filesystem::path& ct, RegisterInputs& inputs) {
    if (!dicom_frame_of_reference(ct).empty()) inputs.dicom_ct = ct;
    if (!options.truth.truth.empty()) inputs.true_world_from_ct = read_pose(options.truth.truth, ct);
}

}  // namespace

RegisterInputs read_register_inputs(const RegisterOptions& options) {
    const auto begin = Clock::now();
    RegisterInputs inputs;
    settle_conflicts(options.start);
    read_poses(options.truth, inputs);

    // The views are kept whole until the start is settled.
    ViewsFile views =
        read_views(options.views.files, {.images = ReadImages::required,
                                         .auto_mask = options.views.auto_mask,
                                         .undistorted = parse_truth(options.views.undistorted, "--undistorted")});
    append(inputs.files, views.files);
    append(inputs.notes, views.notes);
    stop_if_interrupted();

    VolumeFile volume = read_object_volume(options.volume, views.views, [&](const VoxelGrid& grid) {
        return first_guess(options.start, grid, views).world_from_ct;
    });
    inputs.volume = std::move(volume.volume);
    append(inputs.files, volume.files);
    append(inputs.notes, volume.notes);
    stop_if_interrupted();

    append(inputs.notes,
           settle_saturation(options.views.saturation, is_metal(options.volume.file, inputs.volume), views.views));
    FirstGuess guess =
        first_guess(options.start, inputs.volume.grid, views, {0, 0, "", volume.file_grid, volume.files.front()});
    inputs.start_world_from_ct = guess.world_from_ct;
    append(inputs.files, guess.files);
    append(inputs.notes, guess.notes);
    settle_dicom_poses(options, volume.files.front(), inputs);
    inputs.views = std::move(views.views);
    inputs.origins = std::move(views.origins);
    if (inputs.true_world_from_ct && inputs.targets_ct_mm.empty()) {
        inputs.targets_ct_mm = default_targets_ct_mm(inputs.volume);
    }
    inputs.load_s = seconds_since(begin);
    inputs.hashes = hash_inputs(inputs.files);
    return inputs;
}

}  // namespace raylign::detail::apps
