#include "core/base/usable_cores.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <thread>

namespace raylign::detail {
namespace {

TEST(UsableCores, AreThoseOfTheAffinityMask) {
    const int before = usable_cores();
    EXPECT_GE(before, 1);
    int pinned = 0;
    std::thread([&] {  // the mask is of this thread alone
        cpu_set_t cores, one;
        ASSERT_EQ(sched_getaffinity(0, sizeof cores, &cores), 0);
        CPU_ZERO(&one);
        for (int core = CPU_SETSIZE - 1; core >= 0 && CPU_COUNT(&one) == 0; --core) {
            if (CPU_ISSET(core, &cores)) CPU_SET(core, &one);
        }
        ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
        pinned = usable_cores();
    })
        .join();
    EXPECT_EQ(pinned, 1);
    EXPECT_EQ(usable_cores(), before);
}

}  // namespace
}  // namespace raylign::detail
