#include "bench/gpu/counted_api.h"

#include <algorithm>

namespace raylign::detail::bench {
namespace {

std::vector<Calls>& counters() {
    static std::vector<Calls> all;
    return all;
}

/// A function of the table with its number: each needs a function of its own to stand before it.
template <int number, class Function>
struct Counted;

template <int number, class Result, class... Arguments>
struct Counted<number, Result (*)(Arguments...)> {
    static inline Result (*real)(Arguments...) = nullptr;
    static Result call(Arguments... arguments) {
        ++counters()[number].count;
        return real(arguments...);
    }
};

template <int number, class Function>
void count(Function& function, const char* name) {
    if (counters().size() <= number) counters().resize(number + 1);
    counters()[number].name = name;
    if (function == nullptr) return;
    Counted<number, Function>::real = function;
    function = &Counted<number, Function>::call;
}

}  // namespace

gl::Api counted(gl::Api api) {
    constexpr int kFirst = __COUNTER__ + 1;
#define RAYLIGN_COUNT(name) count<__COUNTER__ - kFirst>(api.egl.name, "egl" #name);
    RAYLIGN_EGL_FUNCTIONS(RAYLIGN_COUNT)
#undef RAYLIGN_COUNT
#define RAYLIGN_COUNT(name) count<__COUNTER__ - kFirst>(api.gl.name, "gl" #name);
    RAYLIGN_GL_FUNCTIONS(RAYLIGN_COUNT)
#undef RAYLIGN_COUNT
    return api;
}

std::vector<Calls> calls() {
    std::vector<Calls> made;
    std::ranges::copy_if(counters(), std::back_inserter(made), [](const Calls& c) { return c.count > 0; });
    std::ranges::stable_sort(made, std::ranges::greater(), &Calls::count);
    return made;
}

std::int64_t calls_of(std::string_view name) {
    const auto found = std::ranges::find(counters(), name, &Calls::name);
    return found == counters().end() ? 0 : found->count;
}

std::int64_t all_calls() {
    std::int64_t sum = 0;
    for (const Calls& c : counters()) sum += c.count;
    return sum;
}

void reset_calls() {
    for (Calls& c : counters()) c.count = 0;
}

}  // namespace raylign::detail::bench
