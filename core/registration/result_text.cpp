#include <cmath>
#include <numbers>

#include "core/base/number_text.h"
#include "raylign/result.h"

namespace raylign {
using namespace detail;
namespace {

std::string labelled(std::string label, const std::string& text) {
    label.resize(10, ' ');
    return "  " + label + text + "\n";
}

std::string with_sign(double value, int digits) { return (std::signbit(value) ? "" : "+") + fixed(value, digits); }

/// "x +1.00, y -2.00, z +0.50"
std::string components(const Eigen::Vector3d& v) {
    return "x " + with_sign(v.x(), 2) + ", y " + with_sign(v.y(), 2) + ", z " + with_sign(v.z(), 2);
}

/// The update result * start^-1: shift of the rotation centre and rotation vector, both along world axes.
std::string update_text(const RegistrationResult& result) {
    const RigidTransform &start = result.start_world_from_ct, &end = result.world_from_ct;
    const Eigen::Vector3d shift_mm = end * result.rotation_centre_ct_mm - start * result.rotation_centre_ct_mm;
    const Eigen::Vector3d turn_deg = log(end * inverse(start)).head<3>() * (180 / std::numbers::pi);
    return labelled("moved", fixed(shift_mm.norm(), 2) + " mm  (" + components(shift_mm) + ")") +
           labelled("turned", fixed(turn_deg.norm(), 2) + " deg (" + components(turn_deg) + ")");
}

std::string costs_text(const RegistrationResult& result, int digits) {
    const std::string before = std::isfinite(result.cost_initial) ? fixed(result.cost_initial, digits) + " -> " : "";
    return before + fixed(result.cost_final, digits);
}

std::string axis_text(const Eigen::Vector3d& axis) {
    return with_sign(axis.x(), 2) + ", " + with_sign(axis.y(), 2) + ", " + with_sign(axis.z(), 2);
}

/// "0.042 mm", or for one view "0.15 mm in plane, 1.41 mm in depth, 0.25 deg".
std::string expected_text(const Confidence& c) {
    if (c.in_depth_mm > 0) {
        return fixed(c.in_plane_mm, 3) + " mm in plane, " + fixed(c.in_depth_mm, 2) + " mm in depth, " +
               fixed(c.rotation_deg, 2) + " deg";
    }
    return fixed(c.rim_mm, 3) + " mm";
}

std::string confidence_text(const Confidence& c) {
    if (c.is_withheld) return labelled("expected", "error not estimated: the pose is doubted");
    if (!c.is_estimated) return {};
    return labelled("sigma", fixed(c.translation_mm, 3) + " mm, " + fixed(c.rotation_deg, 3) + " deg; weakest along (" +
                                 axis_text(c.weakest_direction) + "): " + fixed(c.weakest_mm, 3) + " mm, about (" +
                                 axis_text(c.weakest_axis) + "): " + fixed(c.weakest_deg, 3) + " deg") +
           labelled("expected", expected_text(c) + " (root mean square error of the object's points)" +
                                    (c.in_depth_mm > 0 ? "; one view tells depth by size only" : ""));
}

std::string search_text(const SearchReport& search) {
    if (search.starts == 0) return {};
    return labelled("search",
                    (search.mode == Search::none ? "around the result" : std::string(search_name(search.mode))) + ": " +
                        std::to_string(search.starts) + " starts, " + std::to_string(search.refined) + " refined, " +
                        std::to_string(search.agreeing) + " ended here, " + std::to_string(search.rivals.size()) +
                        " rivals");
}

}  // namespace

std::string brief(const RegistrationResult& result) {
    std::string text = result.ok ? "ok" : "doubtful";
    if (std::isfinite(result.cost_final)) text += ": cost " + costs_text(result, 4);
    if (result.confidence.is_estimated) text += ", expected error " + expected_text(result.confidence);
    if (result.confidence.is_withheld) text += ", expected error not estimated as the pose is doubted";
    return text + ", " + std::to_string(result.iterations) + " iterations, " + fixed(result.total_s, 2) + " s";
}

std::string full(const RegistrationResult& result) {
    std::string text = result.ok ? "registered\n" : "DOUBTFUL: the result must not be used unchecked\n";
    for (const std::string& reason : result.reasons) text += labelled("why", reason);
    text += update_text(result);
    if (std::isfinite(result.cost_final)) {
        text += labelled("cost", costs_text(result, 5) + " (" + std::string(metric_name(result.metric)) +
                                     ": 0 = perfect, 1 = unrelated)");
    }
    text += confidence_text(result.confidence) + search_text(result.search);
    for (const std::string& decision : result.decisions) text += labelled("decided", decision);
    const std::uint64_t poses = result.counters.evaluations + result.counters.linearizations;
    return text + labelled("time", fixed(result.total_s, 2) + " s, " + std::string(method_name(result.method)) + ", " +
                                       std::to_string(result.iterations) + " iterations, " + std::to_string(poses) +
                                       " poses compared");
}

}  // namespace raylign
