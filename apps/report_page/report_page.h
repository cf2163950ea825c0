#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "raylign/io/image.h"
#include "raylign/view.h"

namespace raylign::detail::apps {

/// A picture over a picture, with a slider between them.
struct PageLayer {
    std::string label;
    std::string uri;  ///< data:image/png;base64,...
};
struct PageOverlay {
    std::string title;
    PageLayer base;
    std::vector<PageLayer> layers;
    /// Of several objects the DRR of each, labelled by its name: outlined in a colour of its own instead of the last
    /// layer.
    std::vector<PageLayer> objects;
};

/// A self-contained HTML page: works offline, loads nothing. `kind`: register, scene (several objects), study, compare,
/// bench, track or batch; `report`: the JSON that the page shows; `more`: further members of the page's data, JSON
/// texts by name.
[[nodiscard]] std::string report_page(std::string_view kind, std::string_view report,
                                      const std::vector<PageOverlay>& overlays,
                                      const std::vector<std::pair<std::string, std::string>>& more = {});

/// A line-integral image as a layer: bone bright, at most 512 px a side, grey values by the 1st to 99th percentile.
/// `scratch`: a folder where a file may stand for a moment.
[[nodiscard]] PageLayer page_layer(const std::string& label, const Image& image, const Image& weights,
                                   const std::filesystem::path& scratch);

/// The X-ray of a view under its DRRs at the start and as found.
[[nodiscard]] PageOverlay page_overlay(const std::string& title, const View& view, const Image& drr_start,
                                       const Image& drr_found, const std::filesystem::path& scratch);

[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace raylign::detail::apps
