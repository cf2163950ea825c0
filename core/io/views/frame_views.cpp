#include "raylign/io/frames.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>

#include "core/base/error.h"
#include "core/base/fault_text.h"
#include "core/io/geometry/distortion.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace {

std::string size_text(const Eigen::Vector2i& size_px) {
    return std::to_string(size_px.x()) + " x " + std::to_string(size_px.y());
}

std::string name_of(const FrameFile& frame) {
    return frame.file.string() + (frame.frame > 0 ? ", frame " + std::to_string(frame.frame) : "");
}

void check_size(const Eigen::Vector2i& size_px, const View& view, const FrameFile& frame) {
    const Eigen::Vector2i& camera_px = view.geometry.camera.size_px;
    if (size_px == camera_px) return;
    throw bad_value("size of the frame " + name_of(frame), size_text(size_px),
                    "the camera's size_px, " + size_text(camera_px), "view " + view.name);
}

void check(const FrameRange& range) {
    if (range.step < 1) throw bad_value("frame step", std::to_string(range.step), "at least 1");
    if (range.first && range.last && *range.first > *range.last) {
        throw bad_value("first frame", std::to_string(*range.first),
                        "at most the last, " + std::to_string(*range.last));
    }
}

/// "AP has 1 to 60"
std::string extent_text(const View& view, const std::vector<FrameFile>& frames) {
    return view.name + " has " + std::to_string(frames.front().number) + " to " + std::to_string(frames.back().number);
}

/// All pixels that count are one value: no beam, or a lost frame.
bool is_blank(const Image& image, const Image& weights) {
    std::optional<float> first;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (!std::isfinite(image.pixels[i]) || (!weights.empty() && weights.pixels[i] == 0)) continue;
        if (!first) first = image.pixels[i];
        if (image.pixels[i] != *first) return false;
    }
    return true;
}

/// The conversion grows or falls with the pixels: the sign of their covariance.
Polarity polarity_of(const Image& stored, const XrayConversion& converted) {
    double count = 0, x = 0, y = 0, xy = 0;
    for (std::size_t i = 0; i < stored.pixels.size(); ++i) {
        if (!std::isfinite(stored.pixels[i])) continue;
        if (!converted.weights.empty() && converted.weights.pixels[i] == 0) continue;
        ++count;
        x += stored.pixels[i];
        y += converted.line_integral.pixels[i];
        xy += static_cast<double>(stored.pixels[i]) * converted.line_integral.pixels[i];
    }
    return xy * count >= x * y ? Polarity::bone_bright : Polarity::bone_dark;
}

using FrameSets = std::map<int, FrameSet>;  // by number

/// Numbers that no view has, between those that are there: time passed there, too. The sequence's own step is the
/// largest that meets all numbers; where it would lack more than it has, the numbers do not count frames.
void add_lacking(FrameSets& sets) {
    std::int64_t step = 0;
    const auto first = sets.begin();
    if (first == sets.end()) return;
    const std::int64_t begin = first->first, end = sets.rbegin()->first;
    for (const auto& [number, unused] : sets) step = std::gcd(step, number - begin);
    const auto count = static_cast<std::int64_t>(sets.size());
    if (step == 0 || (end - begin) / step + 1 > 2 * count) return;
    const std::vector<std::optional<FrameFile>> none(first->second.files.size());
    for (std::int64_t number = begin; number < end; number += step) {
        sets.try_emplace(static_cast<int>(number), FrameSet{static_cast<int>(number), none});
    }
}

FrameSets all_frames(const ViewsFile& views) {
    FrameSets sets;
    for (std::size_t v = 0; v < views.views.size(); ++v) {
        for (const FrameFile& frame : views.origins[v].frames) {
            FrameSet& set = sets[frame.number];
            set.number = frame.number;
            set.files.resize(views.views.size());
            set.files[v] = frame;
        }
    }
    add_lacking(sets);
    return sets;
}

}  // namespace

std::vector<FrameSet> pair_frames(const ViewsFile& views, const FrameRange& range) {
    check(range);
    FrameSets by_number = all_frames(views);
    std::erase_if(by_number, [&](const auto& item) {
        return item.first < range.first.value_or(item.first) || item.first > range.last.value_or(item.first);
    });
    std::vector<FrameSet> sets;
    for (auto& [number, set] : by_number) {
        const int first = range.first.value_or(by_number.begin()->first);
        if ((number - first) % range.step == 0) sets.push_back(std::move(set));
    }
    const auto is_full = [](const FrameSet& set) {
        return std::ranges::all_of(set.files, [](const auto& file) { return file.has_value(); });
    };
    if (std::ranges::any_of(sets, is_full)) return sets;
    std::string extents;
    for (std::size_t v = 0; v < views.views.size(); ++v) {
        extents += (v == 0 ? "" : ", ") + extent_text(views.views[v], views.origins[v].frames);
    }
    throw Error("frames: no number in the range is in all views (" + extents + ")");
}

void check_frame_sizes(const ViewsFile& views, const std::vector<FrameSet>& frames) {
    std::vector<std::filesystem::path> checked(views.views.size());  // the frames of one file have one size
    for (const FrameSet& set : frames) {
        for (std::size_t v = 0; v < set.files.size(); ++v) {
            if (!set.files[v] || set.files[v]->file == checked[v]) continue;
            checked[v] = set.files[v]->file;
            std::optional<Eigen::Vector2i> size_px;
            try {
                size_px = xray_size_px(checked[v]);
            } catch (const Error&) {
                continue;  // unreadable: a gap, when its turn comes
            }
            check_size(*size_px, views.views[v], *set.files[v]);
        }
    }
}

InstantReader::InstantReader(ViewsFile views)
    : views_(std::move(views)), readers_(views_.views.size()), is_settled_(views_.views.size()) {
    for (std::size_t v = 0; v < views_.views.size(); ++v) {
        const std::optional<Distortion>& distortion = views_.origins[v].distortion;
        maps_.push_back(distortion ? std::make_shared<const PixelMap>(
                                         undistortion_map(views_.views[v].geometry.camera, *distortion))
                                   : nullptr);
    }
}

View InstantReader::make_view(std::size_t view, const FrameFile& file, RawXray raw) {
    View result = views_.views[view];  // without an image; its weights are the mask
    ViewOrigin& origin = views_.origins[view];
    for (Image* image : {&raw.image, &raw.shutter, &raw.valid}) detail::flip_image(*image, origin.flip);
    if (maps_[view]) undistort(raw, *maps_[view]);
    if (is_blank(raw.image, result.weights)) return result;
    XrayConversion converted = line_integral_from_xray(raw, result.weights, origin.intensity, name_of(file));
    if (!is_settled_[view]) {
        is_settled_[view] = true;
        origin.intensity.polarity = polarity_of(raw.image, converted);
        for (const std::string& decision : converted.decisions) notes_.push_back(result.name + ": " + decision);
    }
    result.image = std::move(converted.line_integral);
    result.weights = std::move(converted.weights);
    return result;
}

Instant InstantReader::read(const FrameSet& frames) {
    Instant instant;
    for (std::size_t v = 0; v < views_.views.size(); ++v) {
        const std::string label = "view " + views_.views[v].name;
        if (!frames.files[v]) {
            instant.gap = label + " has no frame " + std::to_string(frames.number);
            return instant;
        }
        const FrameFile& file = *frames.files[v];
        try {
            RawXray raw = readers_[v].read(file);
            check_size({raw.image.width, raw.image.height}, views_.views[v], file);
            instant.views.push_back(make_view(v, file, std::move(raw)));
        } catch (const Error& error) {  // names the file
            instant.gap = label + ": " + error.what();
            return instant;
        } catch (const std::exception& failure) {  // whatever is wrong: it costs this frame, not the sequence
            instant.gap = label + ": " + name_of(file) + ": " + fault_text(failure);
            return instant;
        }
        if (instant.views.back().image.empty()) {
            instant.gap = label + ": " + name_of(file) + " is empty (all pixels have one value)";
            return instant;
        }
    }
    return instant;
}

}  // namespace raylign
