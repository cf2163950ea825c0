#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/register/options.h"
#include "apps/shared/manifest.h"
#include "raylign/io/views.h"
#include "raylign/rigid_transform.h"
#include "raylign/view.h"
#include "raylign/volume.h"

namespace raylign::detail::apps {

/// Everything that `register` reads.
struct RegisterInputs {
    Volume volume;
    std::vector<View> views;
    std::vector<ViewOrigin> origins;  ///< of the views
    RigidTransform start_world_from_ct;
    std::optional<RigidTransform> true_world_from_ct;
    std::vector<Eigen::Vector3d> targets_ct_mm;            ///< given, or with --truth the default ones; else empty
    std::optional<Eigen::Vector3d> rotation_centre_ct_mm;  ///< the middle of the targets, where they were given
    std::vector<std::string> notes;                        ///< what was decided on reading, for the report
    std::vector<std::filesystem::path> files;              ///< every file read
    std::filesystem::path dicom_ct;  ///< a file of the CT, where it is DICOM and says its frame of reference; else ""
    InputHashes hashes;              ///< of them
    double load_s = 0;
};

/// Reads the files that the options name, the small ones first: a typo in a JSON file should not wait for a large CT.
[[nodiscard]] RegisterInputs read_register_inputs(const RegisterOptions& options);

}  // namespace raylign::detail::apps
