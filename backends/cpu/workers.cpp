#include "backends/cpu/workers.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <optional>
#include <stdexcept>

#include "raylign/error.h"

namespace raylign::detail::cpu {

/// More than any option allows, and the same for all: the smallest of several such limits counts, and TBB complains on
/// stderr about each arena beyond it.
constexpr std::size_t kAnyNumber = 4096;

struct Workers::Arena {
    explicit Arena(int threads) : arena(threads) {
        if (threads > usable_cores()) more_than_cores.emplace(tbb::global_control::max_allowed_parallelism, kAnyNumber);
    }
    std::optional<tbb::global_control> more_than_cores;  // TBB stops at the number of cores unless told
    tbb::task_arena arena;
};

Workers::Workers(int threads) : threads_(threads), arena_(std::make_unique<Arena>(threads)) {}
Workers::~Workers() = default;

void Workers::run(std::size_t count, const void* object, void (*turn)(const void*, std::size_t, int)) {
    if (threads_ == 1 || count == 1) {
        for (std::size_t i = 0; i < count; ++i) turn(object, i, 0);
        return;
    }
    // In order, each turn to the thread that is free: threads on neighbouring tiles share voxels in the cache, while
    // TBB's halves of the range make two threads read 10 % more slowly than one (256^3, 256^2).
    std::atomic<std::size_t> next = 0;
    const auto share = [&](int) {
        const int slot = tbb::this_task_arena::current_thread_index();
        for (std::size_t i = next++; i < count; i = next++) turn(object, i, slot);
    };
    try {
        arena_->arena.execute([&] { tbb::parallel_for(0, threads_, share, tbb::simple_partitioner()); });
    } catch (const Error&) {
        throw;
    } catch (const std::runtime_error&) {  // TBB's way to say that pthread_create failed; turns throw nothing
        throw Error("the system gives no more threads: --backend cpu works with one by --threads 1",
                    ErrorKind::unavailable);
    }
}

int usable_cores() { return tbb::info::default_concurrency(); }

}  // namespace raylign::detail::cpu
