#include "core/image/bone_split.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace raylign::detail {
namespace {

constexpr double kSeed_share = 0.1;  // of the least volume: what erosion must leave of a bone
/// Of what erosion took at corners: how far a piece grows back. What lies farther is another bone whose core was lost.
constexpr int kReach = 2;
constexpr double kMiddle_share = 0.2;  // of a bone on either side makes it one of the middle

using Mask = std::vector<std::uint8_t>;

/// Steps between neighbours in memory, per axis.
std::array<std::size_t, 3> strides_of(const Eigen::Vector3i& size) {
    const auto row = static_cast<std::size_t>(size.x());
    return {1, row, row * static_cast<std::size_t>(size.y())};
}

/// Calls visit(index) for the six neighbours that lie in the grid.
template <class Visit>
void for_each_neighbour(std::size_t index, const Eigen::Vector3i& size, const Visit& visit) {
    const std::array<std::size_t, 3> strides = strides_of(size);
    for (int axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<int>(index / strides[axis] % static_cast<std::size_t>(size[axis]));
        if (at > 0) visit(index - strides[axis]);
        if (at + 1 < size[axis]) visit(index + strides[axis]);
    }
}

/// Fills what is not bone, but enclosed by it, in every axial slice, up to `most` pixels.
void fill_holes(Mask& mask, const Eigen::Vector3i& size, std::size_t most) {
    const std::size_t slice = static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    const Eigen::Vector3i flat(size.x(), size.y(), 1);
    for (std::size_t first = 0; first < mask.size(); first += slice) {
        std::vector<bool> seen(slice, false);
        for (std::size_t start = 0; start < slice; ++start) {
            if (seen[start] || mask[first + start] != 0) continue;
            std::vector<std::size_t> hole{start};
            seen[start] = true;
            bool is_open = false;
            for (std::size_t k = 0; k < hole.size(); ++k) {  // grows while it is walked
                const auto x = static_cast<int>(hole[k] % static_cast<std::size_t>(size.x()));
                const auto y = static_cast<int>(hole[k] / static_cast<std::size_t>(size.x()));
                is_open = is_open || x == 0 || y == 0 || x + 1 == size.x() || y + 1 == size.y();
                for_each_neighbour(hole[k], flat, [&](std::size_t next) {
                    if (seen[next] || mask[first + next] != 0) return;
                    seen[next] = true;
                    hole.push_back(next);
                });
            }
            if (is_open || hole.size() > most) continue;
            for (const std::size_t pixel : hole) mask[first + pixel] = 1;
        }
    }
}

/// Keeps what has `half` voxels of bone on either side along an axis.
void erode_along(Mask& mask, const Eigen::Vector3i& size, int axis, int half) {
    const std::size_t stride = strides_of(size)[axis];
    const int length = size[axis];
    for (std::size_t first = 0; first < mask.size(); ++first) {
        if (first / stride % static_cast<std::size_t>(length) != 0) continue;  // no beginning of a line
        for (int begin = 0; begin < length;) {
            int end = begin;
            while (end < length && mask[first + static_cast<std::size_t>(end) * stride] != 0) ++end;
            for (int i = begin; i < end; ++i) {
                if (i - begin < half || end - 1 - i < half) mask[first + static_cast<std::size_t>(i) * stride] = 0;
            }
            begin = end + 1;
        }
    }
}

/// Gives every connected piece of at least `least` voxels a number from 1; returns how many.
std::int32_t number_pieces(const Mask& mask, const Eigen::Vector3i& size, std::size_t least,
                           std::vector<std::int32_t>& labels) {
    constexpr std::int32_t kTooSmall = -1;
    std::int32_t count = 0;
    for (std::size_t start = 0; start < mask.size(); ++start) {
        if (mask[start] == 0 || labels[start] != 0) continue;
        std::vector<std::size_t> piece{start};
        labels[start] = ++count;
        for (std::size_t k = 0; k < piece.size(); ++k) {
            for_each_neighbour(piece[k], size, [&](std::size_t next) {
                if (mask[next] == 0 || labels[next] != 0) return;
                labels[next] = count;
                piece.push_back(next);
            });
        }
        if (piece.size() >= least) continue;
        --count;
        for (const std::size_t voxel : piece) labels[voxel] = kTooSmall;
    }
    std::ranges::replace(labels, kTooSmall, 0);
    return count;
}

/// Lets the pieces grow through the bone, one layer after the other, by at most so many.
void grow(const Mask& bone, const Eigen::Vector3i& size, int layers, std::vector<std::int32_t>& labels) {
    std::vector<std::size_t> front;
    for (std::size_t i = 0; i < labels.size(); ++i) {
        if (labels[i] != 0) front.push_back(i);
    }
    for (; layers > 0 && !front.empty(); --layers) {
        std::vector<std::size_t> next_front;
        for (const std::size_t voxel : front) {
            for_each_neighbour(voxel, size, [&](std::size_t next) {
                if (bone[next] == 0 || labels[next] != 0) return;
                labels[next] = labels[voxel];
                next_front.push_back(next);
            });
        }
        front = std::move(next_front);
    }
}

/// Where a piece lies.
struct PieceSite {
    std::int64_t voxels = 0, left = 0;  ///< of these on the patient's left of the middle
    double height_mm = 0;               ///< sum over voxels, towards the head
};

std::vector<PieceSite> sites_of(const LabelMap& map, std::int32_t count) {
    double middle_mm = 0;
    std::int64_t all = 0;
    const Eigen::Vector3i& size = map.grid.size;
    const auto point = [&](std::size_t i) {
        const auto x = static_cast<double>(i % static_cast<std::size_t>(size.x()));
        const auto y = static_cast<double>(i / static_cast<std::size_t>(size.x()) % static_cast<std::size_t>(size.y()));
        const std::size_t z = i / strides_of(size)[2];
        return map.grid.ct_from_voxel({x, y, static_cast<double>(z)});
    };
    for (std::size_t i = 0; i < map.labels.size(); ++i) {
        if (map.labels[i] == 0) continue;
        middle_mm += point(i).x();
        ++all;
    }
    middle_mm /= static_cast<double>(std::max<std::int64_t>(all, 1));
    std::vector<PieceSite> places(static_cast<std::size_t>(count) + 1);
    for (std::size_t i = 0; i < map.labels.size(); ++i) {
        if (map.labels[i] == 0) continue;
        const Eigen::Vector3d at = point(i);
        PieceSite& place = places[static_cast<std::size_t>(map.labels[i])];
        ++place.voxels;
        place.left += at.x() > middle_mm ? 1 : 0;
        place.height_mm += at.z();
    }
    return places;
}

std::string side_of(const PieceSite& place) {
    const double left = static_cast<double>(place.left) / static_cast<double>(place.voxels);
    return left > 1 - kMiddle_share ? "left" : left < kMiddle_share ? "right" : "middle";
}

/// Renumbers the pieces that are large enough, from the head down.
void name_bones(BoneSplit& split, std::int32_t count, double least_mm3) {
    const std::vector<PieceSite> places = sites_of(split.map, count);
    const double voxel_mm3 = split.map.grid.spacing_mm.prod();
    std::vector<std::int32_t> order;
    for (std::int32_t piece = 1; piece <= count; ++piece) {
        if (static_cast<double>(places[piece].voxels) * voxel_mm3 >= least_mm3) order.push_back(piece);
    }
    const auto height = [&](std::int32_t piece) {
        return places[piece].height_mm / static_cast<double>(places[piece].voxels);
    };
    std::ranges::stable_sort(order, std::greater<>(), height);
    std::vector<std::int32_t> label_of_piece(places.size(), 0);
    for (const std::int32_t piece : order) {
        const std::string side = side_of(places[piece]);
        const auto before =
            std::ranges::count_if(split.bones, [&](const SplitBone& b) { return b.name.starts_with(side); });
        const auto label = static_cast<std::int32_t>(split.bones.size() + 1);
        label_of_piece[piece] = label;
        split.bones.push_back(
            {side + "_" + std::to_string(before + 1), label, static_cast<double>(places[piece].voxels) * voxel_mm3});
    }
    for (std::int32_t& label : split.map.labels) label = label_of_piece[static_cast<std::size_t>(label)];
}

}  // namespace

BoneSplit split_bones(const Volume& ct, const BoneSplitOptions& options) {
    const VoxelGrid& grid = ct.grid;
    Mask bone(ct.attenuation_per_mm.size());
    std::ranges::transform(ct.attenuation_per_mm, bone.begin(),
                           [&](float mu) { return static_cast<std::uint8_t>(mu > options.above_per_mm ? 1 : 0); });
    const double pixel_mm2 = grid.spacing_mm.x() * grid.spacing_mm.y();
    fill_holes(bone, grid.size, static_cast<std::size_t>(options.hole_mm2 / pixel_mm2));
    Mask core = bone;
    int eroded = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const int half = std::max(1, static_cast<int>(std::lround(options.opening_mm / grid.spacing_mm[axis])));
        erode_along(core, grid.size, axis, half);
        eroded += half;
    }
    BoneSplit split{{grid, std::vector<std::int32_t>(bone.size(), 0)}, {}};
    const auto least = static_cast<std::size_t>(kSeed_share * options.least_mm3 / grid.spacing_mm.prod());
    const std::int32_t count = number_pieces(core, grid.size, std::max<std::size_t>(1, least), split.map.labels);
    grow(bone, grid.size, kReach * eroded, split.map.labels);
    name_bones(split, count, options.least_mm3);
    if (split.bones.empty()) {
        throw Error("no bone of at least " + number_text(options.least_mm3 / 1000) + " cm3 found above " +
                    number_text(options.above_per_mm) + " /mm");
    }
    return split;
}

}  // namespace raylign::detail
