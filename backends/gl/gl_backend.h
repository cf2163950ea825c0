#pragma once

#include <memory>
#include <string>
#include <vector>

#include "raylign/backends.h"

namespace raylign::detail {

/// Whether OpenGL in software will do: it is slower than the cpu backend, so only where it is asked for by name.
enum class Software { allowed, refused };

/// A device of this machine that OpenGL can be asked for.
struct GlDevice {
    int index = 0;
    std::string name, vendor, version, node;
    bool software = false;
    int texture_3d_voxels = 0, texture_layers = 0;  ///< along one axis
    std::size_t memory_bytes = 0;                   ///< 0 = the driver does not tell
    std::string problem;                            ///< why it cannot be used; empty if it can
};
/// Empty where there is no OpenGL at all; `problem` then says why.
[[nodiscard]] std::vector<GlDevice> gl_devices(std::string& problem);

/// OpenGL 4.5 compute shaders, through EGL without a display. Throws Error for a bad option and, kind unavailable, with
/// the reason where OpenGL cannot run here.
[[nodiscard]] std::unique_ptr<Backend> make_gl_backend(const GlOptions& options, Software software = Software::allowed);

/// The pipeline of [Ino06] in fragment shaders: the paper's own, for comparison. Without derivatives. Throws as
/// make_gl_backend does; prepare() throws for slices that do not fit the projector.
[[nodiscard]] std::unique_ptr<Backend> make_gl_2006_backend(const Gl2006Options& options,
                                                            Software software = Software::allowed);

}  // namespace raylign::detail
