#pragma once

#include <cstddef>
#include <memory>

namespace raylign::detail::cpu {

/// Threads to run loops on. Which thread takes which turn is left to chance: turns must not depend on each other.
class Workers {
public:
    explicit Workers(int threads);
    ~Workers();

    [[nodiscard]] int threads() const { return threads_; }

    /// Calls turn(i, slot) for every i in [0, count), begun in this order. Turns that run at the same time have
    /// different slots in [0, threads()).
    template <class Turn>
    void run(std::size_t count, const Turn& turn) {
        run(count, &turn,
            [](const void* object, std::size_t i, int slot) { (*static_cast<const Turn*>(object))(i, slot); });
    }

private:
    // A std::function would allocate for each loop.
    void run(std::size_t count, const void* object, void (*turn)(const void* object, std::size_t i, int slot));

    struct Arena;
    int threads_;
    std::unique_ptr<Arena> arena_;
};

/// Cores that this process may use (its affinity mask, not the machine's count).
[[nodiscard]] int usable_cores();

}  // namespace raylign::detail::cpu
