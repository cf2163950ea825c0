#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>

#include "core/backend.h"
#include "core/base/error.h"
#include "raylign/backends.h"

namespace raylign::detail::test {

/// True where `name` is in RAYLIGN_REQUIRE_BACKENDS ("reference,cpu"): a test then fails instead of skipping.
inline bool is_required(const std::string& name) {
    const char* list = std::getenv("RAYLIGN_REQUIRE_BACKENDS");
    std::stringstream names(list == nullptr ? "" : list);
    for (std::string entry; std::getline(names, entry, ',');) {
        if (entry == name) return true;
    }
    return false;
}

/// Options under which a backend is held to the float tolerances: float voxels, interpolated in the shader. What
/// texture filters and 16-bit voxels do is tested in tests/backends/gl and tests/backends/cpu.
inline BackendOptions parity_options() {
    BackendOptions options;
    options.cpu.storage = options.gl.storage = options.gl_2006.storage = Storage::float32;
    options.gl.interpolation = options.gl_2006.interpolation = Interpolation::exact;
    return options;
}

/// A backend's name as GoogleTest takes it: letters and digits only.
inline std::string test_name(std::string name) {
    std::erase(name, '-');
    return name;
}

}  // namespace raylign::detail::test

/// Makes the backend `wanted` into `variable`; skips with the reason where it cannot run here, or fails where it is
/// required.
#define RAYLIGN_MAKE_BACKEND(variable, wanted)                                                                  \
    std::unique_ptr<raylign::Backend> variable;                                                                 \
    try {                                                                                                       \
        variable = raylign::create_backend(wanted, raylign::detail::test::parity_options()).backend;            \
    } catch (const raylign::Error& error) {                                                                     \
        if (raylign::detail::test::is_required(wanted)) FAIL() << (wanted) << " is required: " << error.what(); \
        GTEST_SKIP() << error.what();                                                                           \
    }                                                                                                           \
    ASSERT_EQ(variable->info().name, wanted) << "another backend than the one asked for ran"
