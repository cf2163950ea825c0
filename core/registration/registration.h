#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/backend.h"
#include "core/optimize/termination.h"

namespace raylign {

enum class Method {
    automatic,         ///< the driver picks and says what it picked
    gauss_newton,      ///< Levenberg-Marquardt with analytic derivatives (Session::linearize), coarse to fine
    steepest_descent,  ///< [Ino06] section 2.3: central differences, line search, coarse to fine
};
[[nodiscard]] std::string_view method_name(Method method);  ///< "auto", "gauss-newton", "steepest-descent"
[[nodiscard]] Method method_from_name(std::string_view name);

struct RegistrationOptions {
    Method method = Method::automatic;
    Similarity similarity;  ///< filter: as wide as given on the finest level, narrower on coarser ones
    RenderSettings render;
    int levels = 0;  ///< resolutions, each half the next; 0 = until images are about 32 px; in [0, 8]
    int max_iterations_per_level = 100;  ///< in [1, 10000]
    /// Default: the object's centre (centroid of the attenuation).
    std::optional<Eigen::Vector3d> rotation_centre_ct_mm;
    /// Asked before every batch of evaluations; true stops the run: the driver then throws Error(kind cancelled).
    std::function<bool()> cancelled;
};

/// One accepted step of the optimizer.
struct IterationRecord {
    int level = 0;  ///< 0 = coarsest
    int iteration = 0;
    double cost = 0;
    double step_mm = 0;  ///< how far the step moved the object's rim
    RigidTransform world_from_ct;
};

struct LevelReport {
    Eigen::Vector3i volume_size = Eigen::Vector3i::Zero();
    Eigen::Vector3d spacing_mm = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector2i> image_sizes_px;
    GradientFilter filter;
    double cost_initial = 0, cost_final = 0;
    int iterations = 0;
    std::uint64_t evaluations = 0, linearizations = 0;
    bool restarted = false;        ///< the start's cost was lower than that of the coarser level's result
    std::size_t volume_bytes = 0;  ///< the engine's own copy
    double time_s = 0;
    Termination termination = Termination::converged;
};

struct RegistrationResult {
    RigidTransform world_from_ct;
    Method method = Method::steepest_descent;  ///< what ran; never automatic
    std::string method_reason;                 ///< why, if it was chosen
    double cost_initial = 0, cost_final = 0;   ///< on the finest level: of the start and of the result
    std::vector<double> view_costs;            ///< of the result, per view, finest level
    std::vector<LevelReport> levels;           ///< coarsest first
    std::vector<IterationRecord> history;
    int iterations = 0;
    SessionCounters counters;  ///< summed over levels
    SessionTiming timing;      ///< summed over levels
    double optimizer_s = 0;    ///< wall time outside prepare and the engine
    double total_s = 0;
    bool ok = false;                   ///< the verdict
    std::vector<std::string> reasons;  ///< why not, in words for people; empty if ok
};

struct RegistrationProgress {
    int level = 0, levels = 1;
    int iteration = 0;
    double cost = 0;
    double fraction = 0;     ///< of the whole run, estimated, in [0, 1]
    double remaining_s = 0;  ///< estimated
};
/// Called after each step; return false to stop: the driver then throws Error(kind cancelled).
using ProgressCallback = std::function<bool(const RegistrationProgress&)>;

/// Finds world_from_ct at which the DRRs of the volume match the views' images, starting from `start_world_from_ct`.
/// Every view needs an image. Throws Error for a bad scene or options and for a start whose DRR misses a detector.
[[nodiscard]] RegistrationResult register_volume(const Volume& volume, std::span<const View> views,
                                                 const RigidTransform& start_world_from_ct,
                                                 const RegistrationOptions& options, Backend& backend,
                                                 const ProgressCallback& progress = {});

}  // namespace raylign
