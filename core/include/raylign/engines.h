#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/backend.h"

namespace raylign {

/// Options for making a backend; each is used where it has a meaning and refused where a wrong value would mislead.
struct BackendOptions {
    int threads = 0;              ///< cpu: worker threads, 0 = all cores of this process; in [0, 1024]
    std::string instruction_set;  ///< cpu: "" = best that the processor has; else sse2 (or neon), avx2, avx512
    std::string device;           ///< gl: index (see BackendStatus::devices) or part of the renderer's name
    /// Voxels of the engine's own copy: "float32", or with cpu and gl "int16", half the memory. "" or "auto" = int16 on
    /// gl, whose textures filter it as fast; on cpu float32 as long as it fits (see CpuOptions).
    std::string storage;
    std::string interpolation;  ///< gl: "" or "hardware": by texture filters (8-bit fractions on GPUs), or "exact"
    bool crop = false;          ///< gl: keep only the box around the object, for volumes too large for the device
    /// gl-2006, baselines of the paper; "" = its own way: slices view-aligned or object-aligned (as the projector
    /// says), reduction passes, mipmap or mipmap-half, readback sums or image.
    std::string slices, reduction, readback;
};

/// Instruction set that a backend of this build has kernels for, and whether this processor has it.
struct InstructionSet {
    std::string name;
    bool available = false;
};

/// A device that OpenGL knows of.
struct DeviceStatus {
    int index = 0;  ///< for BackendOptions::device
    std::string name, vendor, version;
    std::string node;  ///< "/dev/dri/renderD128", where it has one
    bool software = false;
    int texture_3d_voxels = 0, texture_layers = 0;  ///< the most along one axis of a volume
    std::size_t memory_bytes = 0;                   ///< 0 = the driver does not tell
    std::string problem;                            ///< why it cannot be used; empty if it can
};

/// A backend in the list and whether it can run here.
struct BackendStatus {
    std::string name;
    std::string summary;
    bool available = false;
    std::string reason;                                 ///< why it cannot run; empty if it can
    BackendInfo info = {};                              ///< with default options, if it can run
    std::vector<InstructionSet> instruction_sets = {};  ///< of a CPU engine, best first
    std::vector<DeviceStatus> devices = {};             ///< of a GPU engine
};

/// All backends of this build, best first; "reference" last.
[[nodiscard]] std::vector<std::string> backend_names();
[[nodiscard]] std::vector<BackendStatus> backend_statuses();

struct BackendChoice {
    std::unique_ptr<Backend> backend;
    std::vector<BackendStatus> passed_over;  ///< with "auto": the better ones that could not run, with reasons
};

/// The named backend, or with "auto" the best that runs here ("reference" and software OpenGL are only taken by name).
/// Throws Error for an unknown name or a storage that the named one lacks (listing the valid ones) and, kind
/// unavailable, for one that cannot run here.
[[nodiscard]] BackendChoice create_backend(std::string_view name, const BackendOptions& options = {});

}  // namespace raylign
