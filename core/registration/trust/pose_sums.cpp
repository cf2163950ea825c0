#include "core/registration/trust/pose_sums.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/similarity/linearization.h"

namespace raylign::detail {
namespace {

constexpr int kBlocksPerSide = 8;
constexpr int kBandRows = 32;               // summed in one turn
constexpr int kImages = 7;                  // the DRR and its derivatives
constexpr double kLeastCorrelation = 0.05;  // of the information: below, nothing is known

using GroupSums = std::array<JacobianSums, kGroups>;

struct WeightBox {
    int x0, y0, x1, y1;
};

WeightBox box_with_weight(const Image& weights) {
    WeightBox box{weights.width, weights.height, 0, 0};
    for (int y = 0; y < weights.height; ++y) {
        for (int x = 0; x < weights.width; ++x) {
            if (!(weights(x, y) > 0)) continue;
            box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
        }
    }
    return box;
}

/// One channel of a view: what the metric compares, and what moves it.
struct Channel {
    const Image* fixed;
    std::array<Image, kImages> moving;
    std::array<Image, kDistortions> distorted;
    Image seventh;  ///< derivative by the seventh parameter; empty where it is not asked for
};

/// One view's images, filtered.
struct Seen {
    const Image* weights;
    const Image* robust;  ///< part of them; null: none
    WeightBox box;
    std::vector<Channel> channels;
};

/// Filters the images of a view, each in a turn of its own.
Seen see(Session& session, const RigidTransform& world_from_ct, const Eigen::Vector3d& centre_ct_mm, std::size_t view,
         const SeventhDerivative& seventh) {
    const DrrWithDerivatives rendered = session.render_with_derivatives(world_from_ct, centre_ct_mm, view);
    const FixedChannels& fixed = session.fixed_channels(view);
    constexpr std::size_t kSeventh = kImages + kDistortions;
    std::array<std::vector<Image>, kSeventh + 1> filtered;
    session.for_each_index(seventh ? kSeventh + 1 : kSeventh, [&](std::size_t i) {
        if (i == kSeventh) {
            filtered[i] = session.channels_of(seventh(rendered.drr, view));
        } else if (i >= kImages) {
            filtered[i] = session.channels_of(distorted(static_cast<Distortion>(i - kImages), rendered.drr));
        } else {
            filtered[i] = session.channels_of(i == 0 ? rendered.drr : rendered.derivatives[i - 1]);
        }
    });
    Seen seen{&fixed.weights, nullptr, box_with_weight(fixed.weights), {}};
    for (std::size_t c = 0; c < fixed.channels.size(); ++c) {
        Channel& channel = seen.channels.emplace_back();
        channel.fixed = &fixed.channels[c];
        for (int i = 0; i < kImages; ++i) channel.moving[i] = std::move(filtered[i][c]);
        for (int i = 0; i < kDistortions; ++i) channel.distorted[i] = std::move(filtered[kImages + i][c]);
        if (seventh) channel.seventh = std::move(filtered[kSeventh][c]);
    }
    return seen;
}

/// Pixels next to each other in a row.
struct Stretch {
    std::size_t begin, end;
};

void add_moving(const Channel& channel, const Image& weights, const Stretch& pixels, JacobianSums& sums) {
    for (std::size_t p = pixels.begin; p < pixels.end; ++p) {
        const double w = weights.pixels[p], b = channel.moving[0].pixels[p];
        std::array<double, 6> jacobian;
        for (int i = 0; i < 6; ++i) jacobian[i] = channel.moving[1 + i].pixels[p];
        sums.moments.weight += w;
        sums.moments.moving += w * b;
        sums.moments.moving_moving += w * b * b;
        for (int i = 0, k = 0; i < 6; ++i) {
            const double weighted = w * jacobian[i];
            sums.jacobian[i] += weighted;
            sums.moving_jacobian[i] += b * weighted;
            for (int j = i; j < 6; ++j, ++k) sums.jacobian_jacobian[k] += weighted * jacobian[j];
        }
    }
}

void add_fixed(const Image& fixed, const Channel& channel, const Image& weights, const Stretch& pixels,
               JacobianSums& sums) {
    for (std::size_t p = pixels.begin; p < pixels.end; ++p) {
        const double weighted = static_cast<double>(weights.pixels[p]) * fixed.pixels[p];
        sums.moments.fixed += weighted;
        sums.moments.fixed_fixed += weighted * fixed.pixels[p];
        sums.moments.fixed_moving += weighted * channel.moving[0].pixels[p];
        for (int i = 0; i < 6; ++i) sums.fixed_jacobian[i] += weighted * channel.moving[1 + i].pixels[p];
    }
}

ColumnSums column_sums(const Channel& channel, const Image& weights, const Stretch& pixels) {
    ColumnSums sums;
    for (std::size_t p = pixels.begin; p < pixels.end; ++p) {
        const double column = channel.seventh.pixels[p], weighted = weights.pixels[p] * column;
        sums.sum += weighted;
        sums.fixed += weighted * channel.fixed->pixels[p];
        sums.moving += weighted * channel.moving[0].pixels[p];
        sums.squared += weighted * column;
        for (int i = 0; i < 6; ++i) sums.jacobian[i] += weighted * channel.moving[1 + i].pixels[p];
    }
    return sums;
}

/// sum w |J|^2 of the derivatives by translation, and what of it robust weights that follow the pose leave.
struct Energy {
    double all = 0, left = 0;

    Energy& operator+=(const Energy& other) {
        all += other.all;
        left += other.left;
        return *this;
    }
};

Energy energy_of(const Channel& channel, const Seen& seen, const Stretch& pixels) {
    Energy energy;
    for (std::size_t p = pixels.begin; p < pixels.end; ++p) {
        double squared = 0;
        for (int i = 4; i < kImages; ++i) squared += channel.moving[i].pixels[p] * channel.moving[i].pixels[p];
        squared *= seen.weights->pixels[p];
        energy.all += squared;
        energy.left += squared * (seen.robust ? std::max(0.0, 4.0 * std::sqrt(seen.robust->pixels[p]) - 3) : 1);
    }
    return energy;
}

/// What one turn adds up: some rows of one channel.
struct Band {
    GroupSums groups;
    std::array<ColumnSums, kGroups> seventh;
    std::array<JacobianSums, kDistortions> distorted;  ///< only what depends on the fixed image
    std::array<std::uint64_t, kGroups> pixels{};       ///< with weight
    Energy energy;
};

/// Calls visit(group, stretch) for the stretches of a row that lie in one block each.
template <class Visit>
void for_blocks(const Seen& seen, int y, const Visit& visit) {
    const WeightBox& box = seen.box;
    const int block_y = (y - box.y0) * kBlocksPerSide / (box.y1 - box.y0), width = box.x1 - box.x0;
    for (int block_x = 0; block_x < kBlocksPerSide; ++block_x) {
        const auto first_of = [&](int block) { return box.x0 + (block * width + kBlocksPerSide - 1) / kBlocksPerSide; };
        const int begin = first_of(block_x), end = first_of(block_x + 1);
        if (begin >= end) continue;
        const std::size_t at = seen.weights->index(begin, y);
        visit(group_of(block_x, block_y), Stretch{at, at + static_cast<std::size_t>(end - begin)});
    }
}

Band sum_band(const Seen& seen, const Channel& channel, int first_row, int end_row) {
    Band band;
    const Image& weights = *seen.weights;
    for (int y = first_row; y < end_row; ++y) {
        for_blocks(seen, y, [&](int group, const Stretch& pixels) {
            // A row's sums first: see moment_sums.
            JacobianSums row;
            add_moving(channel, weights, pixels, row);
            add_fixed(*channel.fixed, channel, weights, pixels, row);
            band.groups[group] += row;
            for (int d = 0; d < kDistortions; ++d) {
                JacobianSums distorted_row;
                add_fixed(channel.distorted[d], channel, weights, pixels, distorted_row);
                band.distorted[d] += distorted_row;
            }
            if (!channel.seventh.pixels.empty()) band.seventh[group] += column_sums(channel, weights, pixels);
            for (std::size_t p = pixels.begin; p < pixels.end; ++p) band.pixels[group] += weights.pixels[p] > 0;
            band.energy += energy_of(channel, seen, pixels);
        });
    }
    return band;
}

Band& operator+=(Band& sum, const Band& band) {
    for (int g = 0; g < kGroups; ++g) sum.groups[g] += band.groups[g];
    for (int g = 0; g < kGroups; ++g) sum.seventh[g] += band.seventh[g];
    for (int g = 0; g < kGroups; ++g) sum.pixels[g] += band.pixels[g];
    for (int d = 0; d < kDistortions; ++d) sum.distorted[d] += band.distorted[d];
    sum.energy += band.energy;
    return sum;
}

/// All rows of each channel.
std::vector<Band> sum_channels(Session& session, const Seen& seen) {
    const int rows = std::max(0, seen.box.y1 - seen.box.y0), bands = (rows + kBandRows - 1) / kBandRows;
    const auto count = static_cast<std::size_t>(bands);
    std::vector<Band> parts(seen.channels.size() * count);
    session.for_each_index(parts.size(), [&](std::size_t i) {
        const int first = seen.box.y0 + static_cast<int>(i % count) * kBandRows;
        parts[i] = sum_band(seen, seen.channels[i / count], first, std::min(first + kBandRows, seen.box.y1));
    });
    std::vector<Band> sums(seen.channels.size());
    for (std::size_t i = 0; i < parts.size(); ++i) sums[i / count] += parts[i];
    return sums;
}

/// Sums with another fixed image: what depends on it comes from `fixed`.
JacobianSums with_fixed(JacobianSums sums, const JacobianSums& fixed) {
    sums.moments.fixed = fixed.moments.fixed;
    sums.moments.fixed_fixed = fixed.moments.fixed_fixed;
    sums.moments.fixed_moving = fixed.moments.fixed_moving;
    sums.fixed_jacobian = fixed.fixed_jacobian;
    return sums;
}

/// The sums of all groups but one; -1: of all. Added up anew, as subtracting would leave a rounding error where a group
/// holds nearly all.
JacobianSums sums_without(const GroupSums& groups, int left_out) {
    JacobianSums sums;
    for (int g = 0; g < kGroups; ++g) {
        if (g != left_out) sums += groups[g];
    }
    return sums;
}

ScaledLinearization scaled_without(const std::vector<Band>& channels, int left_out) {
    std::vector<JacobianSums> sums;
    std::vector<ColumnSums> columns(channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c) {
        sums.push_back(sums_without(channels[c].groups, left_out));
        for (int g = 0; g < kGroups; ++g) {
            if (g != left_out) columns[c] += channels[c].seventh[g];
        }
    }
    return linearize_scaled(sums, columns);
}

double information_of(double cost, const std::vector<Band>& channels) {
    Energy energy;
    for (const Band& channel : channels) energy += channel.energy;
    const double left = energy.all > 0 ? energy.left / energy.all : 1;
    return std::max(kLeastCorrelation, 1 - cost) * left;
}

ViewSums view_sums(const std::vector<Band>& channels, bool is_scaled) {
    ViewSums view;
    const auto linearized = [&](const auto& sums_of) {
        std::vector<JacobianSums> sums;
        for (const Band& channel : channels) sums.push_back(sums_of(channel));
        return linearize_view(sums);
    };
    view.all = linearized([](const Band& channel) { return sums_without(channel.groups, -1); });
    for (int g = 0; g < kGroups; ++g) {
        view.without[g] = linearized([g](const Band& channel) { return sums_without(channel.groups, g); });
    }
    for (int d = 0; d < kDistortions; ++d) {
        view.distorted[d] = linearized(
            [d](const Band& channel) { return with_fixed(sums_without(channel.groups, -1), channel.distorted[d]); });
    }
    for (int g = -1; is_scaled && g < kGroups; ++g) view.scaled.push_back(scaled_without(channels, g));
    view.information = information_of(view.all.cost, channels);
    std::uint64_t pixels = 0;
    for (const std::uint64_t in_group : channels.front().pixels) pixels += in_group;
    view.leaves_enough = std::ranges::all_of(
        channels.front().pixels, [pixels](std::uint64_t in_group) { return pixels - in_group >= kMinPixels; });
    return view;
}

}  // namespace

std::vector<double> shares_of(const Session& session) {
    std::vector<double> shares;
    for (std::size_t v = 0; v < session.view_count(); ++v) shares.push_back(session.view_share(v));
    return shares;
}

int group_of(int block_x, int block_y) { return (5 * block_x + 3 * block_y) % kGroups; }

std::vector<ViewSums> pose_sums(Session& session, const RigidTransform& world_from_ct,
                                const Eigen::Vector3d& centre_ct_mm, const std::function<void()>& before_view,
                                const SeventhDerivative& seventh, std::span<const Image> robust) {
    std::vector<ViewSums> sums;
    for (std::size_t v = 0; v < session.view_count(); ++v) {
        before_view();
        Seen seen = see(session, world_from_ct, centre_ct_mm, v, seventh);
        if (!robust.empty()) seen.robust = &robust[v];
        sums.push_back(view_sums(sum_channels(session, seen), static_cast<bool>(seventh)));
    }
    return sums;
}

}  // namespace raylign::detail
