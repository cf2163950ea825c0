#pragma once

#include <functional>
#include <memory>

#include "core/backend.h"

namespace raylign::detail::test {

/// What is wrong with a backend. Empty parts are right.
struct Fault {
    std::function<void(Volume&)> in_volume;  ///< before it becomes resident
    std::function<void(RayFrame&)> in_geometry;
    std::function<void(MomentSums&)> in_sums;
    std::function<void(JacobianSums&)> in_derivatives;
    std::function<void(Image&)> in_image;
};

/// A backend with a planted fault: the scalar reference otherwise.
[[nodiscard]] std::unique_ptr<Backend> make_faulty_backend(const Fault& fault);

}  // namespace raylign::detail::test
