#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/backend.h"
#include "raylign/termination.h"

namespace raylign {

class ResidentVolume;

enum class Method {
    automatic,         ///< the driver picks and says what it picked
    gauss_newton,      ///< Levenberg-Marquardt with analytic derivatives (Session::linearize), coarse to fine
    steepest_descent,  ///< [Ino06] section 2.3: central differences, line search, coarse to fine
    bobyqa,            ///< [Powell09] quadratic models of the cost, no derivatives; through NLopt
};
[[nodiscard]] std::string_view method_name(Method method);  ///< "auto", "gauss-newton", "steepest-descent", "bobyqa"
[[nodiscard]] Method method_from_name(std::string_view name);

/// How much of the X-ray the volume explains.
enum class Content {
    automatic,  ///< tried as whole; as part where that correlates weakly
    whole,      ///< nearly all of it: the same anatomy, but for implants, noise, another contrast
    part,       ///< one bone among other tissue: compared near the object only, fine edges, robust weights
};
[[nodiscard]] std::string_view content_name(Content content);  ///< "auto", "whole", "part"
[[nodiscard]] Content content_from_name(std::string_view name);

/// Where starts are sought besides the one given.
enum class Search {
    automatic,  ///< none; near where the content is part
    none,
    near,    ///< around the start, within a range
    global,  ///< all poses with the object's centre in the field of view, turned within a range from the start's
};
[[nodiscard]] std::string_view search_name(Search search);  ///< "auto", "none", "near", "global"
[[nodiscard]] Search search_from_name(std::string_view name);

struct SearchOptions {
    Search mode = Search::automatic;
    double range_mm = 0;     ///< near: how far the object may be off; 0 = 20; in [0, 500]
    double range_deg = 0;    ///< largest turn from the start; 0 = 60 near, 45 global; in [0, 180]
    int starts = 0;          ///< of a whole: poses tried; 0 = 6144 near, 8192 global; in [0, 1000000]
    std::uint64_t seed = 1;  ///< of a whole; a part is sought exhaustively (template_search.h)
};

struct RegistrationOptions {
    Method method = Method::automatic;
    Similarity similarity;  ///< filter: as wide as given on the finest level, narrower on coarser ones
    RenderSettings render;
    int levels = 0;  ///< resolutions, each half the next; 0 = until images are about 32 px; in [0, 8]
    int max_iterations_per_level = 100;  ///< in [1, 10000]
    Content content = Content::automatic;
    SearchOptions search;
    bool robust = true;       ///< weigh down what the DRR cannot explain (gauss-newton only)
    double time_limit_s = 0;  ///< then the best pose so far is returned, as doubtful; 0 = none
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
    Content content = Content::whole;
    double cost_initial = 0, cost_final = 0;
    int iterations = 0;
    std::uint64_t evaluations = 0, linearizations = 0;
    bool restarted = false;        ///< the start's cost was lower than that of the coarser level's result
    std::size_t volume_bytes = 0;  ///< the engine's own copies
    std::string volume_layout;     ///< how it keeps them (Session::volume_layout)
    double time_s = 0;
    Termination termination = Termination::converged;
};

/// Another pose that explains the X-rays nearly as well.
struct Rival {
    RigidTransform world_from_ct;
    double cost = 0;          ///< under the weights that the result was chosen by, like SearchReport::cost
    double shift_mm = 0;      ///< of the object's centre from the result's
    double rotation_deg = 0;  ///< from the result
};

struct SearchReport {
    Search mode = Search::none;  ///< what ran; never automatic
    double range_mm = 0;         ///< near: how far from the start was looked
    std::int64_t starts = 0;     ///< poses tried
    int refined = 0;             ///< of these, refined
    int agreeing = 0;            ///< refined ones that ended at the result
    double cost = 0;             ///< of the result where the finalists were compared
    std::vector<Rival> rivals;   ///< distinct other ends, best first
};

/// How sure the pose is, from leaving parts of the images out (see confidence.h).
struct Confidence {
    bool is_estimated = false;  ///< all else is zero if not
    /// Of the twist (rad, mm) about the object's centre in world.
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    double translation_mm = 0;  ///< root of the trace of the translation's covariance
    double rotation_deg = 0;    ///< root of the trace of the rotation's covariance
    double rim_mm = 0;          ///< root mean square shift of points of the object: what mTRE to expect
    Eigen::Vector3d weakest_direction = Eigen::Vector3d::Zero();  ///< of translation, in world; unit
    double weakest_mm = 0;                                        ///< sigma along it
};

struct RegistrationResult {
    RigidTransform world_from_ct;
    Method method = Method::steepest_descent;  ///< what ran; never automatic
    std::string method_reason;                 ///< why, if it was chosen
    Content content = Content::whole;          ///< what it was registered as; never automatic
    std::vector<std::string> decisions;        ///< what the driver chose and why, in order
    /// Finest level, final weights: of the start and of the result. NaN where time was up before; the result's may then
    /// be that of a coarser level.
    double cost_initial = std::numeric_limits<double>::quiet_NaN(), cost_final = cost_initial;
    std::vector<double> view_costs;   ///< of the result, per view, finest level
    std::vector<double> overlap;      ///< share of the object that each view shows on usable pixels, [0, 1]
    std::vector<double> covered;      ///< share of each view's image that the box around the object fills
    std::vector<LevelReport> levels;  ///< coarsest first
    std::vector<IterationRecord> history;
    int iterations = 0;
    int robust_rounds = 0;  ///< how often robust weights were renewed
    SearchReport search;
    Confidence confidence;
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

/// Throws Error for options out of range, and for a search on an engine without derivatives.
void check_options(const RegistrationOptions& options, const Backend& backend);

/// Finds world_from_ct at which the DRRs of the volume match the views' images, starting from `start_world_from_ct`.
/// Every view needs an image. Throws Error for a bad scene or options and for a start whose DRR misses a detector.
[[nodiscard]] RegistrationResult register_volume(const Volume& volume, std::span<const View> views,
                                                 const RigidTransform& start_world_from_ct,
                                                 const RegistrationOptions& options, Backend& backend,
                                                 const ProgressCallback& progress = {});

/// The same on a volume that stays resident: nothing of it is read, halved or laid out anew. Same result, bit for bit.
/// Throws Error also where options.render differs from the volume's.
[[nodiscard]] RegistrationResult register_volume(ResidentVolume& volume, std::span<const View> views,
                                                 const RigidTransform& start_world_from_ct,
                                                 const RegistrationOptions& options,
                                                 const ProgressCallback& progress = {});

}  // namespace raylign
