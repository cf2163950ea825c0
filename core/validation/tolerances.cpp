#include "core/validation/tolerances.h"

#include <algorithm>

namespace raylign::detail {
namespace {

CompareTolerances for_float() {
    return {.image_share = {1e-5, "float sums: some 500 additions of one sign a ray, positions to 2^-15 voxel"},
            .sums_share = {2e-5, "squares of float images: twice their share"},
            .cost = {1e-5, "image differences of 1e-5 of one sign largely cancel in the correlation"},
            .gradient_share = {1e-3, "float derivative images; near a minimum the gradient is a small difference"},
            .differences_share = {3e-2, "kinks of the interpolation at voxel borders; a wrong sign or factor is 100 %"},
            .sweep_mm_or_deg = {2e-3, "a parabola through float costs; far below any accuracy claim"},
            .pose_mtre_mm = {1e-2, "the optimizer's own tolerance, far below any accuracy claim"}};
}

void widen(Tolerance& tolerance, double value, const std::string& reason) {
    if (value > tolerance.value) tolerance = {value, reason};
}

}  // namespace

CompareTolerances compare_tolerances(const BackendInfo& info) {
    CompareTolerances t = for_float();
    if (info.storage == "int16") {
        const std::string reason = "voxels in 16 bits: half a step is 2^-16 of the largest";
        widen(t.image_share, 1e-4, reason);
        widen(t.sums_share, 2e-4, reason);
        widen(t.cost, 1e-4, reason);
        widen(t.gradient_share, 1e-2, reason);
        widen(t.sweep_mm_or_deg, 5e-3, reason);
        widen(t.pose_mtre_mm, 2e-2, reason);
    }
    if (info.interpolation == "hardware") {
        // Derivatives, and the value beside them, come from whole voxels: no texture filter widens gradients.
        const std::string reason = "texture filters: fractions of a voxel in 8 bits";
        widen(t.image_share, kFilterBitsShare, reason);
        widen(t.sums_share, 2 * kFilterBitsShare, reason);
        widen(t.cost, kFilterBitsCost, reason);
        widen(t.sweep_mm_or_deg, 5e-3, reason);
        widen(t.pose_mtre_mm, kFilterBitsPoseMtre_mm, reason);
    }
    return t;
}

CompareTolerances compare_tolerances(BackendInfo info, const std::string& volume_layout) {
    if (volume_layout.starts_with("int16")) info.storage = "int16";
    return compare_tolerances(info);
}

}  // namespace raylign::detail
