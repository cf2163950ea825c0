#pragma once

#include "raylign/phantom.h"

namespace raylign::detail::test {

/// A body without any symmetry: the letter F (readable for someone who faces the patient: its bars point to the
/// patient's left), a ball on the patient's right side near the feet in front, and a rod towards the back. LPS, mm.
inline Phantom letter_phantom() {
    const auto box = [](const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
        return Box{RigidTransform::translate(centre), half, 0.04};
    };
    Phantom phantom{"letter", {}};
    phantom.solids.emplace_back(box({-20, 0, 0}, {5, 4, 40}));     // stem
    phantom.solids.emplace_back(box({5, 0, 35}, {20, 4, 5}));      // upper bar, to the left
    phantom.solids.emplace_back(box({-2.5, 0, 5}, {12.5, 4, 5}));  // middle bar, shorter
    phantom.solids.emplace_back(Ellipsoid{RigidTransform::translate({-35, -25, -30}), {7, 7, 7}, 0.05});
    phantom.solids.emplace_back(box({25, 20, -20}, {3, 18, 3}));  // to the back
    return phantom;
}

}  // namespace raylign::detail::test
