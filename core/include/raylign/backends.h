#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/backend.h"

namespace raylign {

/// How voxels are kept in the backend's own copy; int16 is half the memory, voxels rounded to max / 32767.
enum class Storage { float32, int16 };
/// Of processors, for the kernels of the CPU backend.
enum class InstructionSet { sse2, avx2, avx512, neon };
/// How textures are read between voxels.
enum class Interpolation {
    hardware,  ///< by the texture units: fast, with 8-bit fractions on GPUs
    exact,     ///< in the shader, in float
};
/// Who solves for the steps of method gauss-newton.
enum class Solver {
    host,    ///< the optimizer that all backends share
    device,  ///< the same on the GPU, which then waits for nobody between steps; poses agree to far below a micrometre
};
[[nodiscard]] std::string_view storage_name(Storage storage);                    ///< "float32", "int16"
[[nodiscard]] std::string_view instruction_set_name(InstructionSet set);         ///< "sse2", "avx2", "avx512", "neon"
[[nodiscard]] std::string_view interpolation_name(Interpolation interpolation);  ///< "hardware", "exact"
[[nodiscard]] std::string_view solver_name(Solver solver);                       ///< "host", "device"
[[nodiscard]] Storage storage_from_name(std::string_view name);                  ///< these four throw Error, listing
[[nodiscard]] InstructionSet instruction_set_from_name(std::string_view name);   ///< the valid names
[[nodiscard]] Interpolation interpolation_from_name(std::string_view name);
[[nodiscard]] Solver solver_from_name(std::string_view name);

/// The multithreaded SIMD backend.
struct CpuOptions {
    std::optional<int> threads;  ///< worker threads; default: all cores that this process may use; in [1, 1024]
    /// Default: the environment's RAYLIGN_INSTRUCTION_SET, else the best that the processor has.
    std::optional<InstructionSet> instruction_set;
    /// Default: int16, which is faster with AVX-512, AVX2 and NEON; with SSE2 float32 where the backend's copies stay
    /// within max_volume_bytes. int16 is off by max |attenuation| / 65534 at most, per voxel.
    std::optional<Storage> storage;
    std::size_t max_volume_bytes = std::size_t{2} << 30;  ///< with the caller's volume, 3 of 4 GiB
};

/// OpenGL.
struct GlOptions {
    std::string device;  ///< index (DeviceStatus::index) or part of the renderer's name; default: the first
    Storage storage = Storage::int16;  ///< textures filter it as fast
    Interpolation interpolation = Interpolation::hardware;
    Solver solver = Solver::host;  ///< device: unproven on hardware as yet (bench/README.md, "GPUs"); gl only
    bool crop = false;             ///< keep only the box around the object: for volumes too large for the device
    /// Of the host, for work beside the device; default: all cores that this process may use; in [1, 1024].
    std::optional<int> threads;
};

/// gl-2006, with the baselines of the paper.
struct Gl2006Options : GlOptions {
    enum class Slices { view_aligned, object_aligned };
    enum class Reduction {
        passes,       ///< 3 x 3 to 1
        mipmap,       ///< [Chisu05]
        mipmap_half,  ///< the same in half floats, as then
    };
    enum class Readback {
        sums,   ///< 20 bytes per gradient image
        image,  ///< all of it
    };
    std::optional<Slices> slices;  ///< default: view-aligned with projector trilinear, object-aligned with joseph
    Reduction reduction = Reduction::passes;
    Readback readback = Readback::sums;
};

/// Options of every backend: "auto" reads those of the one that it takes.
struct BackendOptions {
    CpuOptions cpu;
    GlOptions gl;
    Gl2006Options gl_2006;
};

/// Instruction set that a backend of this build has kernels for, and whether this processor has it.
struct InstructionSetStatus {
    InstructionSet set = InstructionSet::sse2;
    bool available = false;
};

/// A device that OpenGL knows of.
struct DeviceStatus {
    int index = 0;  ///< for GlOptions::device
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
    std::string reason;                                       ///< why it cannot run; empty if it can
    BackendInfo info = {};                                    ///< with default options, if it can run
    std::vector<InstructionSetStatus> instruction_sets = {};  ///< of a CPU backend, best first
    std::vector<DeviceStatus> devices = {};                   ///< of a GPU backend
};

/// All backends of this build, best first; "reference" last. The second tries each: it may take a second and never
/// throws for one that cannot run.
[[nodiscard]] std::vector<std::string> backend_names();
[[nodiscard]] std::vector<BackendStatus> backend_statuses();

/// A backend, and why it is this one.
struct BackendChoice {
    std::unique_ptr<Backend> backend;
    std::vector<BackendStatus> passed_over;  ///< with "auto": the better ones that could not run, with reasons
};

/// The named backend, or with "auto" the best that runs here ("reference" and software OpenGL are only taken by name).
/// Throws Error for an unknown name (listing the valid ones) and options out of range and, kind unavailable, for one
/// that cannot run here. Threads: backends share nothing; each belongs to one thread at a time.
[[nodiscard]] BackendChoice create_backend(std::string_view name, const BackendOptions& options = {});

}  // namespace raylign
