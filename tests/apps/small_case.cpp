#include "tests/apps/small_case.h"

namespace raylign::detail::test {
namespace {

constexpr const char* kGeometry = R"({ "raylign": 1, "views": [
  { "name": "AP", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 0, "secondary_angle_deg": 0,
                             "pixel_pitch_mm": [6.2, 6.2], "size_px": [64, 64] } },
  { "name": "LAT", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 90, "secondary_angle_deg": 0,
                              "pixel_pitch_mm": [6.2, 6.2], "size_px": [64, 64] } } ] })";

// Turned by 3 degrees about z and moved by (3, -4, 2.5) mm.
constexpr const char* kTruth = R"({ "raylign": 1, "world_from_ct": [
  [0.99862953, -0.05233596, 0, 3], [0.05233596, 0.99862953, 0, -4], [0, 0, 1, 2.5], [0, 0, 0, 1] ] })";

constexpr const char* kStart = R"({ "raylign": 1, "world_from_ct": [
  [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1] ] })";

}  // namespace

SmallCase::SmallCase(const TestFolder& folder) : folder_(folder) {
    write_text_file(folder.path("geometry.json"), kGeometry);
    write_text_file(folder.path("truth.json"), kTruth);
    write_text_file(folder.path("start.json"), kStart);
}

ProgramResult SmallCase::make_phantom() const {
    return run_raylign({"phantom", "spine", "--size", "64", "--spacing", "3.5", "-o", folder_.path("spine.mha")});
}

ProgramResult SmallCase::simulate() const {
    return run_raylign({"drr", "-v", folder_.path("spine.mha"), "--attenuation", "--views",
                        folder_.path("geometry.json"), "--pose", folder_.path("truth.json"), "--noise", "50000",
                        "--seed", "3", "-o", folder_.path("xrays")});
}

std::vector<std::string> SmallCase::register_arguments(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"register",
                                       "-v",
                                       folder_.path("spine.mha"),
                                       "--attenuation",
                                       "--views",
                                       folder_.path("xrays/views.json"),
                                       "--start",
                                       folder_.path("start.json"),
                                       "-o",
                                       folder_.path("result")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

}  // namespace raylign::detail::test
