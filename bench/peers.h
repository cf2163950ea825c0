#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "raylign/camera.h"
#include "raylign/image.h"
#include "raylign/rigid_transform.h"
#include "raylign/volume.h"

namespace raylign::detail::bench {

/// A DRR and the seconds that its rendering alone took: no loading, no conversion, no file.
struct TimedImage {
    Image image;
    double seconds = 0;
};

/// Another program or library that makes DRRs of one volume.
struct Peer {
    std::string name;
    std::function<TimedImage(const ViewGeometry&, const RigidTransform& world_from_ct)> render;
};

/// Debian's `plastimatch drr -i exact` as a process of its own per DRR. It reads `volume_file` (1/mm, no HU
/// conversion); its image is left in the same folder. Seconds: its "Total time", which starts when the volume is loaded
/// and converted, less its "I/O time", which is writing the image. Throws Error where the command does not run.
[[nodiscard]] Peer plastimatch_peer(const std::filesystem::path& volume_file, int threads);

/// ITK's RayCastInterpolateImageFunction under ResampleImageFilter, as in ITK's own DRR example, in this process.
/// Seconds: the filter's Update(). `volume` is borrowed for the peer's life and must have an identity direction.
[[nodiscard]] Peer itk_peer(const Volume& volume, int threads);

}  // namespace raylign::detail::bench
