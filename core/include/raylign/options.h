#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string_view>

#include "raylign/backend.h"
#include "raylign/similarity.h"

namespace raylign {

/// How one start is refined.
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

/// Where, and how widely, starts are sought.
struct SearchOptions {
    Search mode = Search::automatic;
    std::optional<double> range_mm;   ///< near: how far the object may be off; default 20; in (0, 500]
    std::optional<double> range_deg;  ///< largest turn from the start; default 60 near, 45 global; in (0, 180]
    std::optional<int> starts;        ///< of a whole: poses tried; default 6144 near, 8192 global; in [1, 1000000]
    std::uint64_t seed = 1;           ///< of a whole; a part is sought exhaustively
};

/// How far the cameras may be from where the views say they are (RegistrationOptions::refine_views): standard
/// deviations of each camera's turn about the object's centre and of its shift, about and along each axis.
struct ViewPrior {
    double rotation_deg = 2;     ///< in (0, 30]
    double translation_mm = 10;  ///< in (0, 200]
    /// The view whose camera stays: images tell only where cameras are relative to each other, and it is what the pose
    /// is relative to. None: all share the corrections out, and so does the pose.
    std::optional<std::size_t> kept_view = 0;
};

/// Defaults are meant for most data. register_volume throws Error for values outside the ranges named.
struct RegistrationOptions {
    Method method = Method::automatic;
    Similarity similarity;  ///< filter: as wide as given on the finest level, narrower on coarser ones
    RenderSettings render;
    std::optional<int> levels;  ///< resolutions, each half the next; default: until images are about 32 px; in [1, 8]
    int max_iterations_per_level = 100;  ///< in [1, 10000]
    Content content = Content::automatic;
    SearchOptions search;
    bool robust = true;  ///< weigh down what the DRR cannot explain (gauss-newton only)
    /// Look around the result of a descent for other poses that explain the X-rays as well, go on from one that
    /// explains them better, and doubt the result where one is as good (gauss-newton, a whole, no search).
    bool look_around = true;
    /// Where the result is doubtful, find out whether the images fit far better with their contrast reversed (on the
    /// coarsest level, and before a part is sought) or mirrored (up to seven more registrations; not where there is a
    /// time limit), and say so among the reasons.
    bool suspect_mirrored = true;
    /// Compare what each view would like with what the others say, and doubt views that contradict each other
    /// (gauss-newton, a whole, two views or more): 20 linearizations at the end.
    bool compare_views = true;
    /// Find corrections of the cameras, too, within this prior, and the pose with the corrected cameras. Needs
    /// gauss-newton and at least two views; not with a time limit. Default: cameras are believed.
    std::optional<ViewPrior> refine_views;
    std::optional<double>
        time_limit_s;  ///< then the best pose so far is returned, as doubtful; default: none; positive
    /// Default: the object's centre (centroid of the attenuation).
    std::optional<Eigen::Vector3d> rotation_centre_ct_mm;
};

}  // namespace raylign
