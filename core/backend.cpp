#include "core/backend.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/camera.h"

namespace raylign {
using namespace detail;

std::string detail::vector_text(const Eigen::Vector3d& v) {
    return std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z());
}

namespace {

void check_grid(const VoxelGrid& grid, std::string_view where) {
    if (grid.size.minCoeff() < 1) {
        throw bad_value("volume size", vector_text(grid.size.cast<double>()), "at least 1 voxel per axis", where);
    }
    if (!grid.spacing_mm.allFinite() || grid.spacing_mm.minCoeff() <= 0) {
        throw bad_value("volume spacing", vector_text(grid.spacing_mm) + " mm", "positive and finite", where);
    }
    if (!grid.origin_mm.allFinite()) throw bad_value("volume origin", vector_text(grid.origin_mm), "finite", where);
    const Eigen::Matrix3d product = grid.direction.transpose() * grid.direction;
    if (!((product - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-4)) {
        throw bad_value("volume direction", vector_text(product.diagonal()) + " (squared column lengths)",
                        "orthonormal columns within 1e-4", where);
    }
}

constexpr std::size_t kChunk = 4096;

/// Infinite and NaN have all bits of the exponent set. No branch and no floating point, so that compilers make vectors
/// of it: memory sets the pace, twice that of asking std::isfinite for each voxel.
bool has_non_finite(std::span<const float> values) {
    constexpr std::uint32_t kExponent = 0x7F800000;
    std::uint32_t found = 0;
    for (const float value : values) {
        found |= static_cast<std::uint32_t>((std::bit_cast<std::uint32_t>(value) & kExponent) == kExponent);
    }
    return found != 0;
}

}  // namespace

std::string_view projector_name(Projector projector) { return projector == Projector::joseph ? "joseph" : "trilinear"; }

Projector projector_from_name(std::string_view name) {
    if (name == "joseph") return Projector::joseph;
    if (name == "trilinear") return Projector::trilinear;
    throw bad_value("projector", name, "joseph or trilinear");
}

double detail::trilinear_step_mm(const RenderSettings& settings, const VoxelGrid& grid) {
    return settings.step_mm.value_or(grid.spacing_mm.minCoeff() / 2);
}

void detail::check_shape(const Volume& volume, std::string_view where) {
    check_grid(volume.grid, where);
    const std::size_t voxels = volume.attenuation_per_mm.size();
    const double expected = volume.grid.size.cast<double>().prod();  // integers could wrap around
    if (static_cast<double>(voxels) != expected) {
        const std::string count = expected < 0x1p62 ? std::to_string(std::llround(expected)) : "2^62 or more";
        throw bad_value("voxel count", std::to_string(voxels), count + " as its size says", where);
    }
}

void detail::check_volume(const Volume& volume, std::string_view where) {
    check_shape(volume, where);
    const std::size_t voxels = volume.attenuation_per_mm.size();
    const std::span<const float> all(volume.attenuation_per_mm);
    for (std::size_t begin = 0; begin < voxels; begin += kChunk) {
        const std::span<const float> chunk = all.subspan(begin, std::min(kChunk, voxels - begin));
        if (!has_non_finite(chunk)) continue;
        std::size_t i = begin;
        while (std::isfinite(all[i])) ++i;
        const std::size_t nx = volume.grid.size.x(), ny = volume.grid.size.y();
        const std::string voxel = "voxel (" + std::to_string(i % nx) + ", " + std::to_string(i / nx % ny) + ", " +
                                  std::to_string(i / nx / ny) + ")";
        throw bad_value(voxel, number_text(all[i]), "finite", where);
    }
}

void detail::check_views(std::span<const View> views) {
    if (views.empty()) throw Error("views: at least one is needed");
    for (const View& view : views) {
        check_camera(view.geometry.camera, "view " + view.name);
        if (!(view.ceiling > 0)) {
            throw bad_value("ceiling", number_text(view.ceiling), "positive, or infinite", "view " + view.name);
        }
        if (view.cost_weight > 0 && std::isfinite(view.cost_weight)) continue;
        throw bad_value("cost weight", number_text(view.cost_weight), "positive and finite", "view " + view.name);
    }
}

double detail::finest_step_mm(const VoxelGrid& grid) { return grid.spacing_mm.minCoeff() / 100; }

void detail::check_render(const RenderSettings& render, const VoxelGrid& grid) {
    if (!render.step_mm) return;
    const double step_mm = *render.step_mm, finest_mm = finest_step_mm(grid);
    if (!(step_mm > 0 && step_mm <= 100)) throw bad_value("step_mm", number_text(step_mm), "in (0, 100]");
    if (step_mm < finest_mm) {
        throw bad_value("step_mm", number_text(step_mm),
                        "at least a hundredth of a voxel, " + number_text(finest_mm) + " (finer gains nothing)");
    }
}

void detail::check_scene(const Scene& scene) {
    scene.voxels_are_finite ? check_shape(scene.volume, "the volume") : check_volume(scene.volume, "the volume");
    check_views(scene.views);
    check_render(scene.render, scene.volume.grid);
}

}  // namespace raylign
