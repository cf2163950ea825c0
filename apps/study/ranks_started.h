#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>

namespace raylign::detail::apps {

/// The number of processes that a launcher says it started: mpirun of Open MPI, MPICH and Intel MPI, or srun; 0 without
/// one.
[[nodiscard]] inline int launched_processes() {
    for (const char* name : std::array{"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
        if (const char* value = std::getenv(name)) return std::max(0, std::atoi(value));
    }
    return 0;
}
[[nodiscard]] inline bool started_by_a_launcher() { return launched_processes() > 0; }

}  // namespace raylign::detail::apps
