#include "apps/shared/saturation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/image/saturation.h"
#include "core/io/files/text.h"
#include "raylign/io/volume.h"

namespace raylign::detail::apps {

std::optional<double> parse_saturation(const std::string& text) {
    if (text == "auto") return std::nullopt;
    if (text == "none") return std::numeric_limits<double>::infinity();
    const std::optional<double> value = number_from(text);
    if (value && *value > 0 && *value <= 100) return value;
    throw bad_value("--saturation", text, "auto, none or a line integral in (0, 100]");
}

bool is_metal(const std::filesystem::path& file, const Volume& volume) {
    constexpr float kMetal_per_mm = 0.1F;  // between cortical bone, 0.06, and titanium, 0.17
    return is_model(file) && std::ranges::any_of(volume.attenuation_per_mm, [](float v) { return v > kMetal_per_mm; });
}

std::vector<std::string> settle_saturation(const std::string& text, bool has_metal, std::span<View> views) {
    std::vector<std::string> notes;
    const std::optional<double> said = parse_saturation(text);
    for (View& view : views) {
        view.by_transmission = has_metal && !(said && std::isinf(*said));
        if (said) {
            view.ceiling = *said;
            continue;
        }
        if (!has_metal) continue;  // and a CT knows what its own metal let through
        const std::optional<Saturation> found = find_saturation(view.image, view.weights);
        if (!found) {
            notes.push_back(view.name + ": no flat dense region, so no saturation; --saturation L says one");
            continue;
        }
        view.ceiling = found->ceiling;
        notes.push_back(view.name + ": saturates at a line integral of " + fixed(found->ceiling, 2) + " (" +
                        fixed(100 * found->share, 1) + " % of the image are flat there): so does the DRR");
    }
    return notes;
}

}  // namespace raylign::detail::apps
