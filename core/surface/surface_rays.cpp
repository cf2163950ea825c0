#include "core/surface/surface_rays.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace raylign::detail {
namespace {

constexpr float kOpaque = 80;  // exp(-80) is still an ordinary float

/// A plane that rays run along this closely has no derivatives: it is a wall.
constexpr double kGrazing = 0.01;

/// Column where the edge crosses a row. Both triangles of an edge ask alike: no ray slips between them.
double crossing(const SurfaceCorner& upper, const SurfaceCorner& lower, int row) {
    return upper.x + (row - upper.y) * (lower.x - upper.x) / (lower.y - upper.y);
}

}  // namespace

/// 1 / depth is a + b x + c y on its plane.
struct SurfaceRays::Facet {
    double a, b, c, low_mm, high_mm;
    Eigen::Vector3d plane;  ///< n / n . (p - s): n / n . r at depth 1
};

SurfaceRays::SurfaceRays(const SurfaceProjection& seen, const RayFrame& frame, const Eigen::Vector2i& first_px,
                         const Eigen::Vector2i& size_px, bool is_full)
    : seen_(seen),
      frame_(frame),
      ray_voxel_(frame.ray_voxel(pixel_of_ray(0), pixel_of_ray(0))),
      step_x_voxel_(frame.step_u_voxel / kRaysAlong),
      step_y_voxel_(frame.step_v_voxel / kRaysAlong),
      first_px_(first_px),
      size_px_(size_px),
      x0_(kRaysAlong * first_px.x() - 1),
      y0_(kRaysAlong * first_px.y() - 1),
      width_(kRaysAlong * size_px.x() + 2),
      height_(kRaysAlong * size_px.y() + 2),
      sums_(is_full ? row_begin(height_) : 0),
      lengths_(row_begin(height_)) {}

void SurfaceRays::add(const std::array<SurfaceVertex, 3>& vertices, double attenuation_per_mm) {
    const SurfaceCorner *a = vertices[0].seen, *b = vertices[1].seen, *c = vertices[2].seen;
    double signed_per_mm = seen_.leaving * attenuation_per_mm;                         // turns over with each exchange
    const auto sort = [&](const SurfaceCorner*& upper, const SurfaceCorner*& lower) {  // no branch to guess wrongly
        const bool turns = lower->y < upper->y;
        const SurfaceCorner *first = turns ? lower : upper, *second = turns ? upper : lower;
        upper = first;
        lower = second;
        signed_per_mm = turns ? -signed_per_mm : signed_per_mm;
    };
    sort(a, b);
    sort(b, c);
    sort(a, b);
    const int end_row = std::min(ceiling_of(c->y), y0_ + height_);
    std::optional<Facet> facet;  // most triangles of a fine surface lie between the rays
    for (int row = std::max(ceiling_of(a->y), y0_); row < end_row; ++row) {
        const int of_long = ceiling_of(crossing(*a, *c, row));
        const int of_short = ceiling_of(row < b->y ? crossing(*a, *b, row) : crossing(*b, *c, row));
        const int first = std::max(std::min(of_long, of_short), x0_);
        const int end = std::min(std::max(of_long, of_short), x0_ + width_);
        if (first >= end) continue;
        if (!facet) facet = facet_of(vertices);
        add_row(*facet, row, first, end, of_long < of_short ? signed_per_mm : -signed_per_mm);
    }
}

SurfaceRays::Facet SurfaceRays::facet_of(const std::array<SurfaceVertex, 3>& vertices) const {
    const Eigen::Vector3d& corner = *vertices[0].voxel;
    const Eigen::Vector3d normal = (*vertices[1].voxel - corner).cross(*vertices[2].voxel - corner);
    const Eigen::Vector3d from_source = corner - frame_.source_voxel;
    const double offset = normal.dot(from_source), per_offset = 1 / offset;
    const auto [low, high] =
        std::minmax({vertices[0].seen->depth_mm, vertices[1].seen->depth_mm, vertices[2].seen->depth_mm});
    Facet facet{per_offset * normal.dot(ray_voxel_),
                per_offset * normal.dot(step_x_voxel_),
                per_offset * normal.dot(step_y_voxel_),
                low,
                high,
                Eigen::Vector3d::Zero()};
    const bool is_wall = offset * offset <= kGrazing * kGrazing * normal.squaredNorm() * from_source.squaredNorm();
    if (!is_wall) facet.plane = per_offset * normal;
    return facet;
}

void SurfaceRays::add_row(const Facet& facet, int row, int first, int end, double attenuation_per_mm) {
    const double at_row = facet.a + facet.c * row;
    // Kept between its corners' depths: the plane of a sliver, or of one seen from its edge, is not known well.
    const auto depth_at = [&](int x) {
        const double found_mm = 1 / (at_row + facet.b * x);
        return found_mm > facet.low_mm ? std::min(found_mm, facet.high_mm) : facet.low_mm;
    };
    const double most_mm = frame_.depth_max_mm;
    const auto from_middle = [&](double depth_mm) { return static_cast<float>(depth_mm - seen_.depth_mm); };
    const auto per_mm = static_cast<float>(attenuation_per_mm);
    if (sums_.empty()) {
        float* const lengths = &lengths_[place(first, row)];
        for (int x = first; x < end; ++x) lengths[x - first] += from_middle(std::min(depth_at(x), most_mm)) * per_mm;
        return;
    }
    const Eigen::Vector3f plane = (attenuation_per_mm * facet.plane).cast<float>();
    const Eigen::Vector3f middle = (attenuation_per_mm * seen_.depth_mm * facet.plane).cast<float>();
    const Eigen::Array4f slope(plane.x(), plane.y(), plane.z(), per_mm),
        at_middle(middle.x(), middle.y(), middle.z(), 0), share(1, 1, 1, 0.5F);
    RaySums* const rays = &sums_[place(first, row)];
    for (int x = first; x < end; ++x) {
        const double depth_mm = depth_at(x);
        RaySums& ray = rays[x - first];
        const float t = from_middle(std::min(depth_mm, most_mm));
        if (depth_mm < most_mm) {
            const Eigen::Array4f met = t * slope + at_middle;
            ray.sums += met;
            ray.moments += t * (met * share);
        } else {  // the detector's plane stays where it is
            ray.sums[3] += t * per_mm;
            ray.moments[3] += t * (t * per_mm * share[3]);
        }
    }
}

void SurfaceRays::finish(const Eigen::Vector3d& spacing_mm) {
    for (std::size_t i = 0; i < sums_.size(); ++i) lengths_[i] = sums_[i].length();
    transmissions_.resize(lengths_.size());
    const Eigen::Vector3d step = spacing_mm.cwiseProduct(step_x_voxel_);
    Eigen::ArrayXf attenuated(width_);
    for (int row = 0; row < height_; ++row) {
        Eigen::Vector3d ray = spacing_mm.cwiseProduct(frame_.ray_voxel(pixel_of_ray(x0_), pixel_of_ray(y0_ + row)));
        const std::size_t begin = row_begin(row);
        for (int x = 0; x < width_; ++x, ray += step) {
            const float length = lengths_[begin + static_cast<std::size_t>(x)];
            attenuated[x] = length == 0 ? 0 : -std::clamp(length * static_cast<float>(ray.norm()), 0.F, kOpaque);
        }
        Eigen::Map<Eigen::ArrayXf>(transmissions_.data() + begin, width_) = attenuated.exp();
    }
}

}  // namespace raylign::detail
