#include "apps/register/inputs.h"

#include <chrono>

#include "apps/shared/first_guess.h"
#include "apps/shared/interrupt.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/targets.h"

namespace raylign::detail::apps {
namespace {

template <typename T>
void append(std::vector<T>& list, const std::vector<T>& more) {
    list.insert(list.end(), more.begin(), more.end());
}

void read_poses(const RegisterOptions& options, RegisterInputs& inputs) {
    if (!options.truth.empty()) {
        inputs.true_world_from_ct = read_pose(options.truth);
        inputs.files.push_back(options.truth);
    }
    if (!options.targets.empty()) {
        inputs.targets_ct_mm = read_targets(options.targets);
        inputs.rotation_centre_ct_mm = targets_centre_mm(inputs.targets_ct_mm);
        inputs.files.push_back(options.targets);
    }
}

}  // namespace

RegisterInputs read_register_inputs(const RegisterOptions& options) {
    const auto begin = std::chrono::steady_clock::now();
    RegisterInputs inputs;
    const StartWishes wishes{options.start, options.landmarks3d, options.landmarks};
    check_wishes(wishes);
    read_poses(options, inputs);

    // The views are kept whole until the start is settled.
    ViewsFile views = read_views(options.views, {.images = ReadImages::required, .auto_mask = options.auto_mask});
    append(inputs.files, views.files);
    append(inputs.notes, views.notes);
    stop_if_interrupted();

    VolumeFile volume = read_volume(options.volume.file, volume_read_options(options.volume));
    inputs.volume = std::move(volume.volume);
    append(inputs.files, volume.files);
    append(inputs.notes, volume.notes);
    stop_if_interrupted();

    FirstGuess guess = first_guess(wishes, inputs.volume.grid, views);
    inputs.start_world_from_ct = guess.world_from_ct;
    append(inputs.files, guess.files);
    append(inputs.notes, guess.notes);
    inputs.views = std::move(views.views);
    if (inputs.true_world_from_ct && inputs.targets_ct_mm.empty()) {
        inputs.targets_ct_mm = default_targets_ct_mm(inputs.volume);
    }
    inputs.load_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return inputs;
}

}  // namespace raylign::detail::apps
