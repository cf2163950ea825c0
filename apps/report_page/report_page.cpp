#include "apps/report_page/report_page.h"

#include <fstream>
#include <iterator>

#include "apps/pictures/picture.h"
#include "apps/report_page/page_files.h"
#include "apps/report_page/page_script.h"
#include "apps/report_page/page_text.h"
#include "apps/shared/json_text.h"

namespace raylign::detail::apps {
namespace {

constexpr int kLongestSide_px = 512;

Json json_of(const PageLayer& layer) { return {{"label", layer.label}, {"uri", layer.uri}}; }

/// A page with its marks (@TITLE@, ...) replaced, each once, in this order: what is filled in last may hold marks.
std::string filled(std::string page, const std::vector<std::pair<std::string_view, std::string_view>>& texts) {
    for (const auto& [mark, text] : texts) {
        const std::size_t at = page.find(mark);
        if (at != std::string::npos) page.replace(at, mark.size(), text);
    }
    return page;
}

/// JSON for inside <script>: "\u003c" is the same text to JSON.
std::string safe_in_script(std::string_view json) {
    std::string safe;
    safe.reserve(json.size());
    for (const char c : json) {
        if (c == '<') {
            safe += "\\u003c";
        } else {
            safe += c;
        }
    }
    return safe;
}

}  // namespace

std::string framed(const PageParts& parts) {
    return filled(std::string(page_html()), {{"@TITLE@", parts.title},
                                             {"@STYLE@", parts.style},
                                             {"@MAIN@", parts.main},
                                             {"@SCRIPT@", parts.script},
                                             {"@LIBRARIES@", parts.libraries},
                                             {"@DATA@", safe_in_script(parts.data)}});
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        unsigned group = 0;
        for (std::size_t k = 0; k < 3; ++k)
            group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

PageLayer page_layer(const std::string& label, const Image& image, const Image& weights,
                     const std::filesystem::path& scratch) {
    const Image small = shrunk_to(image, kLongestSide_px);
    const Image small_weights = weights.empty() ? Image() : shrunk_to(weights, kLongestSide_px);
    const std::filesystem::path file = scratch / "page_layer.png";
    write_png(file, grey_picture(small, robust_window(small, small_weights)));
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    stream.close();
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
    return {label, "data:image/png;base64," + base64(bytes)};
}

PageOverlay page_overlay(const std::string& title, const View& view, const Image& drr_start, const Image& drr_found,
                         const std::filesystem::path& scratch) {
    return {title,
            page_layer("X-ray " + view.name, view.image, view.weights, scratch),
            {page_layer("DRR at the start", drr_start, view.weights, scratch),
             page_layer("DRR as found", drr_found, view.weights, scratch)}};
}

std::string report_page(std::string_view kind, std::string_view report, const std::vector<PageOverlay>& overlays,
                        const std::vector<std::pair<std::string, std::string>>& more) {
    return report_page(kind, report, overlays, more, {});
}

std::string report_page(std::string_view kind, std::string_view report, const std::vector<PageOverlay>& overlays,
                        const std::vector<std::pair<std::string, std::string>>& more, const PageScript& part) {
    Json images = Json::array();
    for (const PageOverlay& overlay : overlays) {
        Json layers = Json::array();
        for (const PageLayer& layer : overlay.layers) layers.push_back(json_of(layer));
        images.push_back({{"title", overlay.title}, {"base", json_of(overlay.base)}, {"layers", layers}});
        if (overlay.objects.empty()) continue;
        Json objects = Json::array();
        for (const PageLayer& layer : overlay.objects) objects.push_back(json_of(layer));
        images.back()["objects"] = objects;
    }
    std::string data =
        "{\"kind\":\"" + std::string(kind) + "\",\"report\":" + std::string(report) + ",\"images\":" + one_line(images);
    for (const auto& [name, json] : more) data += ",\"" + name + "\":" + json;
    for (const auto& [name, json] : part.data) data += ",\"" + name + "\":" + json;
    data += "}";
    const std::string libraries = std::string(page_charts()) + "\n" + std::string(part.script);
    return framed({.title = "raylign report",
                   .style = page_style(),
                   .main = "report",
                   .data = data,
                   .libraries = libraries,
                   .script = page_script()});
}

}  // namespace raylign::detail::apps
