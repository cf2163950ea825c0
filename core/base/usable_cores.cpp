#include "core/base/usable_cores.h"

#include <sched.h>

#include <algorithm>
#include <thread>

namespace raylign::detail {

int usable_cores() {
    cpu_set_t cores;
    if (sched_getaffinity(0, sizeof cores, &cores) == 0) return CPU_COUNT(&cores);
    return std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);  // more cores than a mask holds
}

}  // namespace raylign::detail
