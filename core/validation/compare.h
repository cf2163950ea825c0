#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/validation/tolerances.h"
#include "raylign/registration.h"

namespace raylign::detail {

/// A backend under a name of its own (two of them may be one backend with different options).
struct NamedBackend {
    std::string name;
    Backend* backend = nullptr;  ///< borrowed
};

struct CompareOptions {
    RenderSettings render;
    Similarity similarity;
    Method method = Method::automatic;
    int poses = 20;             ///< random poses around the given one; in [1, 1000]
    int full_size_poses = 2;    ///< of these, rendered in the views' own size; at most `poses`
    int longest_side_px = 128;  ///< images are halved to this for all else: the oracle is slow; in [32, 4096]
    double spread_mm = 10;      ///< mTRE of the random poses: uniform from 0 to this
    int derivative_poses = 3;   ///< at most `poses`
    int registrations = 3;      ///< 0 = none
    double start_mtre_mm = 8;   ///< of the registrations
    std::uint64_t seed = 1;
    /// Called between pieces of work with what comes next and the share done.
    std::function<void(const std::string& stage, double fraction)> progress;
    StopToken stop;  ///< asked between pieces of work: the comparison then ends with what it has
};

/// One line of the verdict: the oracle against one backend in one quantity.
struct CompareRow {
    std::string step;      ///< image, sums, cost, derivatives, sweep, registration
    std::string quantity;  ///< in words
    std::string oracle, other;
    std::string unit;
    double value = 0;  ///< the largest difference; NaN and infinity never agree
    double rms = 0;    ///< of the differences, where there are many; else 0
    Tolerance tolerance;
    bool agrees = false;
    std::string where;  ///< pose, view, pixel, parameter of the largest
};

/// Costs along one pose parameter.
struct CompareSweep {
    std::string backend, parameter, unit;  ///< "x", ... in mm; "about x", ... in deg
    std::vector<double> offsets, costs;
    double minimum = 0;  ///< offset of the lowest cost; NaN where it lies at an end
};

struct CompareRegistration {
    std::string backend;
    int start = 0;
    RigidTransform world_from_ct;
    double mtre_to_given_mm = 0, mtre_to_oracle_mm = 0, cost = 0;
    int iterations = 0;
    double time_s = 0;
    std::string error;  ///< empty if it ran
};

struct Comparison {
    std::vector<CompareRow> rows;
    std::vector<CompareSweep> sweeps;
    std::vector<CompareRegistration> registrations;
    bool stopped = false;  ///< before its end, by the caller

    /// Every row does, and none is missing.
    [[nodiscard]] bool agrees() const;
};

/// Compares backends with the first one, the oracle, from images to whole registrations: the parity ladder. Every view
/// needs an image. Random poses keep `targets_ct_mm` within `spread_mm` of `world_from_ct` (perturbed_start). A backend
/// that throws in one step disagrees there, with its message as the place. Throws Error for fewer than two backends,
/// options out of range, and a scene that the oracle refuses.
[[nodiscard]] Comparison compare_backends(const Volume& volume, std::span<const View> views,
                                          const RigidTransform& world_from_ct,
                                          std::span<const Eigen::Vector3d> targets_ct_mm,
                                          const std::vector<NamedBackend>& backends, const CompareOptions& options);

}  // namespace raylign::detail
