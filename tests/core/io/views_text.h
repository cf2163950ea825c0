#pragma once

#include <string>

namespace raylign::detail::test {

/// A good view of 8 x 6 pixels; tests replace parts of it.
inline const std::string kCameraView = R"({ "name": "AP",
  "camera": {"size_px": [8, 6], "sdd_mm": 1500, "pixel_pitch_mm": [2, 3], "principal_point_px": [3, 2.5]},
  "camera_from_world": [[1,0,0,0],[0,1,0,0],[0,0,1,1000],[0,0,0,1]] })";

inline std::string views_json(const std::string& views) { return "{ \"raylign\": 1, \"views\": [" + views + "] }"; }

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
}

}  // namespace raylign::detail::test
