#include "core/registration/strategy/template_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace raylign::detail {
namespace {

constexpr double kLattice_rad = 0.2;   // side of the cubes of turns, two points each: none is more than 6.5 degrees off
constexpr std::size_t kPeaks = 6;      // places kept per orientation
constexpr double kApart_spacings = 3;  // between them
constexpr float kSupportShare = 0.01F;          // of the template's largest energy: fainter pixels are left out
constexpr float kEnergyFloorShare = 0.1F;       // of the view's mean energy: empty background must not fit everything
constexpr std::size_t kChunk = 16;              // orientations between two looks at the clock
constexpr double kMostCube = 64e6;              // points of the lattice that are looked at
constexpr std::size_t kMostPlaces = 4'000'000;  // of these, kept: 50 bytes each
constexpr double kWider = 1.26;                 // halves the number of places

/// A pixel of a template, from where the object's centre is projected to; a value per channel.
struct TemplatePixel {
    int dx, dy;
    std::array<float, 2> value;
};

struct Template {
    std::vector<TemplatePixel> pixels;
    float norm = 0;  ///< root of the sum of squares
};

/// The X-ray's side: w F per channel, and sum over channels of w F^2.
struct Target {
    std::vector<Image> channels;
    Image energy;
    float mean_energy = 0;
    Eigen::Vector2i low_px, size_px;  ///< window of centres that are scored
};

/// Places in space, and where in each view's window they are projected to.
struct Places {
    std::vector<Eigen::Vector3d> shift_mm;
    std::vector<std::vector<int>> at;  ///< [view][place], index into the window
};

Target make_target(const FixedChannels& fixed) {
    Target target;
    target.energy = Image(fixed.weights.width, fixed.weights.height);
    double sum = 0, count = 0;
    for (const Image& channel : fixed.channels) {
        Image& weighted = target.channels.emplace_back(channel);
        for (std::size_t i = 0; i < weighted.pixels.size(); ++i) {
            weighted.pixels[i] *= fixed.weights.pixels[i];
            target.energy.pixels[i] += weighted.pixels[i] * channel.pixels[i];
        }
    }
    for (std::size_t i = 0; i < target.energy.pixels.size(); ++i) {
        sum += target.energy.pixels[i];
        count += fixed.weights.pixels[i] > 0;
    }
    target.mean_energy = static_cast<float>(sum / std::max(1.0, count));
    return target;
}

Eigen::Vector2i nearest_pixel(const View& view, const Eigen::Vector3d& point_world_mm) {
    const Eigen::Vector2d pixel = project(view.geometry, point_world_mm);
    return {static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y()))};
}

/// So wide that the lattice's cube has no more than kMostCube points.
double wide_enough_mm(double spacing_mm, double half_side_mm) {
    return std::max(spacing_mm, 2 * half_side_mm / std::cbrt(kMostCube));
}

/// The places of a cubic lattice that all views see, within reach, and the window of each view that they fill; none if
/// there are more than kMostPlaces.
std::optional<Places> make_places(std::span<const View> views, const Eigen::Vector3d& centre_mm, double half_side_mm,
                                  const TemplateRange& range, std::vector<Target>& targets,
                                  const std::function<void(double)>& progress) {
    Places places;
    const double spacing_mm = range.spacing_mm;
    const int n = static_cast<int>(std::floor(half_side_mm / spacing_mm));
    std::vector<std::vector<Eigen::Vector2i>> pixels(views.size());
    const Eigen::Vector3d depth_axis = (centre_mm - source_world_mm(views.front().geometry)).normalized();
    for (int z = -n; z <= n; ++z) {
        progress(0);
        for (int y = -n; y <= n; ++y) {
            for (int x = -n; x <= n; ++x) {
                const Eigen::Vector3d shift_mm = spacing_mm * Eigen::Vector3d(x, y, z);
                if (range.reach_mm > 0 && shift_mm.norm() > range.reach_mm) continue;
                const auto sees = [&](const View& view) { return is_seen(view, centre_mm + shift_mm); };
                if (!std::ranges::all_of(views, sees)) continue;
                if (views.size() == 1 && std::abs(depth_axis.dot(shift_mm)) > spacing_mm / 2) continue;
                if (places.shift_mm.size() == kMostPlaces) return std::nullopt;
                places.shift_mm.push_back(shift_mm);
                for (std::size_t v = 0; v < views.size(); ++v)
                    pixels[v].push_back(nearest_pixel(views[v], centre_mm + shift_mm));
            }
        }
    }
    if (places.shift_mm.empty()) return places;
    for (std::size_t v = 0; v < views.size(); ++v) {
        Eigen::Vector2i low = pixels[v].front(), high = low;
        for (const Eigen::Vector2i& p : pixels[v]) low = low.cwiseMin(p), high = high.cwiseMax(p);
        targets[v].low_px = low;
        targets[v].size_px = high - low + Eigen::Vector2i::Ones();
        std::vector<int>& at = places.at.emplace_back();
        for (const Eigen::Vector2i& p : pixels[v])
            at.push_back((p.y() - low.y()) * targets[v].size_px.x() + p.x() - low.x());
    }
    return places;
}

Template make_template(const std::vector<Image>& moving, const Eigen::Vector2i& centre_px) {
    const Image& first = moving.front();
    std::vector<float> energy(first.pixels.size());
    for (const Image& channel : moving)
        std::ranges::transform(energy, channel.pixels, energy.begin(), [](float e, float m) { return e + m * m; });
    const float least = kSupportShare * *std::ranges::max_element(energy);
    Template result;
    double sum = 0;
    for (int y = 0; y < first.height; ++y) {
        for (int x = 0; x < first.width; ++x) {
            const float e = energy[first.index(x, y)];
            if (!(e > least)) continue;
            sum += e;
            result.pixels.push_back(
                {x - centre_px.x(), y - centre_px.y(), {moving[0](x, y), moving.size() > 1 ? moving[1](x, y) : 0}});
        }
    }
    result.norm = static_cast<float>(std::sqrt(sum));
    return result;
}

/// One row of one template pixel's part in the sums.
void add_row(const Target& target, const TemplatePixel& pixel, int row, int first_x, int begin, int end, float* product,
             float* energy) {
    const float* e = target.energy.pixels.data() + target.energy.index(first_x, row);
    const float* fx = target.channels[0].pixels.data() + target.energy.index(first_x, row);
    if (target.channels.size() == 1) {
        for (int i = 0; i < end - begin; ++i) {
            product[begin + i] += fx[i] * pixel.value[0];
            energy[begin + i] += e[i];
        }
        return;
    }
    const float* fy = target.channels[1].pixels.data() + target.energy.index(first_x, row);
    for (int i = 0; i < end - begin; ++i) {
        product[begin + i] += fx[i] * pixel.value[0] + fy[i] * pixel.value[1];
        energy[begin + i] += e[i];
    }
}

/// Score of every centre in the window.
std::vector<float> score_map(const Target& target, const Template& shape) {
    const int width = target.size_px.x(), height = target.size_px.y();
    const int image_width = target.energy.width, image_height = target.energy.height;
    std::vector<float> product(static_cast<std::size_t>(width) * height), energy(product.size());
    for (int y = 0; y < height; ++y) {
        const std::size_t at = static_cast<std::size_t>(y) * width;
        for (const TemplatePixel& pixel : shape.pixels) {
            const int row = target.low_px.y() + y + pixel.dy, x0 = target.low_px.x() + pixel.dx;
            if (row < 0 || row >= image_height) continue;
            const int begin = std::max(0, -x0), end = std::min(width, image_width - x0);
            if (begin < end)
                add_row(target, pixel, row, x0 + begin, begin, end, product.data() + at, energy.data() + at);
        }
    }
    const float floor = kEnergyFloorShare * target.mean_energy * static_cast<float>(shape.pixels.size());
    for (std::size_t i = 0; i < product.size(); ++i) {
        const float below = shape.norm * std::sqrt(energy[i] + floor);
        product[i] = below > 0 ? product[i] / below : 0;
    }
    return product;
}

/// The orientations of a body-centred cubic lattice of rotation vectors, nominal first.
std::vector<Eigen::Vector3d> turns(double range_rad) {
    std::vector<Eigen::Vector3d> result;
    const int n = static_cast<int>(std::ceil(range_rad / kLattice_rad)) + 1;
    for (int z = -n; z <= n; ++z) {
        for (int y = -n; y <= n; ++y) {
            for (int x = -n; x <= n; ++x) {
                for (const double half : {0.0, 0.5}) {
                    const Eigen::Vector3d turn = kLattice_rad * (Eigen::Vector3d(x, y, z).array() + half).matrix();
                    if (turn.norm() <= range_rad) result.push_back(turn);
                }
            }
        }
    }
    std::ranges::stable_sort(result, {}, [](const Eigen::Vector3d& turn) { return turn.squaredNorm(); });
    return result;
}

class TemplateSearch {
public:
    TemplateSearch(Session& session, std::span<const View> views, const RigidTransform& nominal,
                   const ObjectExtent& extent, const TemplateRange& range, const std::function<void(double)>& progress)
        : session_(session),
          views_(views),
          nominal_(nominal),
          extent_(extent),
          range_(range),
          centre_mm_(nominal * extent.centre_ct_mm) {
        for (std::size_t v = 0; v < views.size(); ++v) targets_.push_back(make_target(session.fixed_channels(v)));
        const double half_side_mm = range.reach_mm > 0 ? range.reach_mm : field_mm(views, centre_mm_) / 2;
        range_.spacing_mm = wide_enough_mm(range.spacing_mm, half_side_mm);
        for (;; range_.spacing_mm *= kWider) {
            std::optional<Places> places = make_places(views, centre_mm_, half_side_mm, range_, targets_, progress);
            if (!places) continue;
            places_ = *std::move(places);
            return;
        }
    }

    std::size_t place_count() const { return places_.shift_mm.size(); }

    std::vector<Candidate> search(std::span<const Eigen::Vector3d> turns) const {
        std::vector<std::vector<Template>> templates;
        for (const Eigen::Vector3d& turn : turns) templates.push_back(templates_of(turn));
        std::vector<std::vector<Candidate>> found(turns.size());
        session_.for_each_index(turns.size(), [&](std::size_t i) { found[i] = peaks(turns[i], templates[i]); });
        std::vector<Candidate> all;
        for (const auto& peaks : found) all.insert(all.end(), peaks.begin(), peaks.end());
        return all;
    }

private:
    RigidTransform turned(const Eigen::Vector3d& turn_rad) const {
        Twist twist = Twist::Zero();
        twist.head<3>() = turn_rad;
        return exp_about(twist, centre_mm_) * nominal_;
    }

    std::vector<Template> templates_of(const Eigen::Vector3d& turn) const {
        std::vector<Template> templates;
        for (std::size_t v = 0; v < views_.size(); ++v) {
            templates.push_back(
                make_template(session_.moving_channels(turned(turn), v), nearest_pixel(views_[v], centre_mm_)));
        }
        return templates;
    }

    /// How far the centre may be from the nominal one at this turn.
    double reach_mm(const Eigen::Vector3d& turn) const {
        const double turned_mm = turn.norm() * extent_.radius_mm;
        return std::sqrt(std::max(0.0, range_.reach_mm * range_.reach_mm - turned_mm * turned_mm));
    }

    std::vector<Candidate> peaks(const Eigen::Vector3d& turn, const std::vector<Template>& templates) const {
        std::vector<float> scores(places_.shift_mm.size());
        for (std::size_t v = 0; v < views_.size(); ++v) {
            if (templates[v].pixels.empty()) return {};
            const std::vector<float> map = score_map(targets_[v], templates[v]);
            const std::vector<int>& at = places_.at[v];
            for (std::size_t i = 0; i < scores.size(); ++i) scores[i] += map[static_cast<std::size_t>(at[i])];
        }
        if (range_.reach_mm > 0) {
            const double reach = reach_mm(turn);
            for (std::size_t i = 0; i < scores.size(); ++i)
                if (places_.shift_mm[i].norm() > reach) scores[i] = -2;
        }
        std::vector<Candidate> found;
        for (std::size_t k = 0; k < kPeaks; ++k) {
            const auto best = static_cast<std::size_t>(std::ranges::max_element(scores) - scores.begin());
            if (scores[best] <= -2) break;
            const Eigen::Vector3d shift_mm = places_.shift_mm[best];
            found.push_back({RigidTransform::translate(shift_mm) * turned(turn),
                             1 - scores[best] / static_cast<double>(views_.size()), 1});
            for (std::size_t i = 0; i < scores.size(); ++i) {
                if ((places_.shift_mm[i] - shift_mm).norm() < kApart_spacings * range_.spacing_mm) scores[i] = -2;
            }
        }
        return found;
    }

    Session& session_;
    std::span<const View> views_;
    RigidTransform nominal_;
    ObjectExtent extent_;
    TemplateRange range_;
    Eigen::Vector3d centre_mm_;
    std::vector<Target> targets_;
    Places places_;
};

}  // namespace

TemplateFits poses_by_templates(Session& session, std::span<const View> views, const RigidTransform& nominal,
                                const ObjectExtent& extent, const TemplateRange& range, std::size_t count,
                                const std::function<void(double)>& progress) {
    const bool near = range.reach_mm > 0;
    const double turn_rad = near ? std::min(range.turn_rad, range.reach_mm / extent.radius_mm) : range.turn_rad;
    const TemplateSearch search(session, views, nominal, extent, range, progress);
    if (search.place_count() == 0) return {};
    const std::vector<Eigen::Vector3d> all = turns(turn_rad);
    TemplateFits fits;
    fits.tried = static_cast<std::int64_t>(all.size() * search.place_count());
    for (std::size_t i = 0; i < all.size(); i += kChunk) {
        progress(static_cast<double>(i) / static_cast<double>(all.size()));
        const std::vector<Candidate> found = search.search(std::span(all).subspan(i, std::min(kChunk, all.size() - i)));
        fits.best.insert(fits.best.end(), found.begin(), found.end());
    }
    std::ranges::stable_sort(fits.best, {}, &Candidate::cost);
    if (fits.best.size() > count) fits.best.resize(count);
    return fits;
}

}  // namespace raylign::detail
