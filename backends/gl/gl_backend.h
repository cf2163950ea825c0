#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/backend.h"

namespace raylign {

struct GlOptions {
    std::string device;                      ///< index in gl_devices(), or part of the renderer's name; "" = the first
    bool software_allowed = true;            ///< false: hardware only
    std::string storage = "int16";           ///< or "float32": voxels on the device
    std::string interpolation = "hardware";  ///< by the texture units, 8-bit fractions on GPUs; or "exact"
    bool crop = false;  ///< keep only the box around the object: for volumes too large for the device
};

/// What gl-2006 may do otherwise, to reproduce what [Ino06] compares with.
struct PaperBaselines {
    std::string slices;  ///< "view-aligned": projector trilinear, "object-aligned": joseph; "" = as the projector says
    std::string reduction =
        "passes";                   ///< 3x3 to 1, or "mipmap" [Chisu 2005], or "mipmap-half": in half floats, as then
    std::string readback = "sums";  ///< 20 bytes per gradient image, or "image": all of it
};

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
[[nodiscard]] std::unique_ptr<Backend> make_gl_backend(const GlOptions& options);

/// The pipeline of [Ino06] in fragment shaders: the paper's own, for comparison. Without derivatives. Throws as
/// make_gl_backend does; prepare() throws for slices that do not fit the projector.
[[nodiscard]] std::unique_ptr<Backend> make_gl_2006_backend(const GlOptions& options,
                                                            const PaperBaselines& baselines = {});

}  // namespace raylign
