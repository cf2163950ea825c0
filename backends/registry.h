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
    std::string device;           ///< gl: index or part of the renderer's name
    /// Voxels of the engine's own copy: "float32", or with cpu "int16", half the memory (error: see CpuOptions).
    std::string storage = "float32";
};

/// Instruction set that a backend of this build has kernels for, and whether this processor has it.
struct InstructionSet {
    std::string name;
    bool available = false;
};

/// A backend in the list and whether it can run here.
struct BackendStatus {
    std::string name;
    std::string summary;
    bool available = false;
    std::string reason;                                 ///< why it cannot run; empty if it can
    BackendInfo info = {};                              ///< with default options, if it can run
    std::vector<InstructionSet> instruction_sets = {};  ///< of a CPU engine, best first
};

/// All backends of this build, best first; "reference" last.
[[nodiscard]] std::vector<std::string> backend_names();
[[nodiscard]] std::vector<BackendStatus> backend_statuses();

struct BackendChoice {
    std::unique_ptr<Backend> backend;
    std::vector<BackendStatus> passed_over;  ///< with "auto": the better ones that could not run, with reasons
};

/// The named backend, or with "auto" the best that runs here ("reference" is only taken by name).
/// Throws Error for an unknown name or a storage that the named one lacks (listing the valid ones) and, kind
/// unavailable, for one that cannot run here.
[[nodiscard]] BackendChoice create_backend(std::string_view name, const BackendOptions& options = {});

}  // namespace raylign
