#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "tests/apps/run_program.h"
#include "tests/support/hdf5_writer.h"

namespace raylign::detail::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr int kVoxels = 40, kPixels = 64;
constexpr double kVoxelMm = 3, kI0 = 60000;

/// A head-like thing of no symmetry: a shell and three lumps, in HU.
std::vector<float> some_hu() {
    std::vector<float> hu;
    const auto ball = [](double x, double y, double z, double r) { return x * x + y * y + z * z < r * r; };
    for (int z = 0; z < kVoxels; ++z) {
        for (int y = 0; y < kVoxels; ++y) {
            for (int x = 0; x < kVoxels; ++x) {
                const double a = kVoxelMm * (x - 19.5), b = kVoxelMm * (y - 19.5), c = kVoxelMm * (z - 19.5);
                float value = -1000;
                if (ball(a, b / 0.8, c, 50)) value = 40;
                if (ball(a, b / 0.8, c, 50) && !ball(a, b / 0.8, c, 44)) value = 900;
                if (ball(a - 20, b - 10, c - 15, 12) || ball(a + 25, b + 5, c + 5, 9)) value = 1200;
                if (ball(a - 5, b + 18, c + 25, 10)) value = -1000;
                hu.push_back(value);
            }
        }
    }
    return hu;
}

/// DeepFluoro's layout around that volume, seen from two sides, with these X-rays.
void write_file(const std::string& path, const std::vector<std::vector<float>>& xrays) {
    const Hdf5Writer file(path);
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k(0, 0) = k(1, 1) = -1000 / 3.2;
    k(0, 2) = 31;
    k(1, 2) = 32.5;
    file.matrix("proj-params/intrinsic", k);
    file.matrix("proj-params/extrinsic", Eigen::Matrix4d::Identity());
    file.number<std::int64_t>("proj-params/num-cols", kPixels);
    file.number<std::int64_t>("proj-params/num-rows", kPixels);
    file.number("proj-params/pixel-col-spacing", 3.2);
    file.number("proj-params/pixel-row-spacing", 3.2);
    file.array("s/vol/pixels", {kVoxels, kVoxels, kVoxels}, some_hu());
    file.matrix("s/vol/spacing", Eigen::Vector3d::Constant(kVoxelMm));
    file.matrix("s/vol/origin", Eigen::Vector3d(-50, -60, -70));
    for (int i = 0; i < 8; ++i) {
        file.matrix("s/vol-landmarks/L" + std::to_string(i),
                    Eigen::Vector3d(-20 + (i & 1) * 55, -30 + (i & 2) * 25, -40 + (i & 4) * 12));
    }
    for (std::size_t view = 0; view < 2; ++view) {
        const std::string group = "s/projections/00" + std::to_string(view) + "/";
        const Eigen::Vector3d centre(8.5, -1.5, -11.5);
        Twist turn;
        turn << -1.5, 0.2, 0.1, 0, 0, 0;
        Twist more = Twist::Zero();
        more[2] = view == 0 ? 0 : 1.2;
        // The camera world lies 650 mm along the viewing direction from the volume's centre.
        const RigidTransform pelvis_from_camera_world =
            RigidTransform::translate(centre) * exp(more) * exp(turn) * RigidTransform::translate({5, -8, 650});
        file.matrix(group + "gt-poses/cam-to-pelvis-vol", to_matrix(pelvis_from_camera_world));
        file.array(group + "image/pixels", {kPixels, kPixels}, xrays[view]);
    }
}

class ImportCommand : public testing::Test {
protected:
    static ProgramResult import(const std::string& file, const std::string& folder) {
        return run_raylign({"import", "deepfluoro", file, "--border", "0", "--i0", std::to_string(kI0), "-o", folder});
    }
    TestFolder folder;
};

TEST_F(ImportCommand, RegisterAndStudyRunOnWhatItWrites) {
    const std::vector<float> blank(kPixels * kPixels, 1000.0F);
    write_file(folder.path("blank.h5"), {blank, blank});
    const ProgramResult first = import(folder.path("blank.h5"), folder.path("geometry"));
    ASSERT_EQ(first.exit_code, 0) << first.err;
    EXPECT_THAT(first.out, HasSubstr("README.md"));
    const std::string truth = folder.path("geometry/pose_000_pelvis.json");
    ASSERT_EQ(run_raylign({"drr", "-v", folder.path("geometry/ct.mha"), "--views", folder.path("geometry/views.json"),
                           "--pose", truth, "--noise", "50000", "-o", folder.path("drr"), "--quiet"})
                  .exit_code,
              0);
    // Simulated X-rays as the file has them: intensities, columns the other way round.
    std::vector<std::vector<float>> xrays;
    for (const std::string name : {"drr/drr_000.tif", "drr/drr_001.tif"}) {
        const Image line_integrals = read_xray(folder.path(name)).image;
        std::vector<float> intensities(line_integrals.pixels.size());
        for (std::size_t i = 0; i < intensities.size(); ++i) {
            const std::size_t mirrored = i - i % kPixels + (kPixels - 1 - i % kPixels);
            intensities[mirrored] = static_cast<float>(kI0 * std::exp(-line_integrals.pixels[i]));
        }
        xrays.push_back(intensities);
    }
    write_file(folder.path("xrays.h5"), xrays);
    ASSERT_EQ(import(folder.path("xrays.h5"), folder.path("case")).exit_code, 0);

    const RigidTransform start =
        RigidTransform::translate({4, -3, 5}) * read_pose(folder.path("case/pose_000_pelvis.json"));
    write_pose(folder.path("start.json"), start);
    const ProgramResult registered =
        run_raylign({"register", "-v", folder.path("case/ct.mha"), "--views", folder.path("case/views.json"), "--start",
                     folder.path("start.json"), "--truth", folder.path("case/pose_000_pelvis.json"), "--targets",
                     folder.path("case/targets.json"), "--json", "-o", folder.path("result")});
    ASSERT_LE(registered.exit_code, 1) << registered.err;
    const json report = json::parse(registered.out);
    EXPECT_GT(report.at("tre").at("initial_mtre_mm").get<double>(), 5);
    EXPECT_LT(report.at("tre").at("final_mtre_mm").get<double>(), 0.6);
    const ProgramResult studied =
        run_raylign({"study", "-v", folder.path("case/ct.mha"), "--views", folder.path("case/views.json"), "--truth",
                     folder.path("case/pose_000_pelvis.json"), "--targets", folder.path("case/targets.json"), "--bins",
                     "0:2:2", "--per-bin", "1", "--quiet", "-o", folder.path("study")});
    EXPECT_EQ(studied.exit_code, 0) << studied.err;
}

TEST_F(ImportCommand, FaultsAreUsageErrors) {
    const auto message = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), "import");
        arguments.insert(arguments.end(), {"-o", folder.path("case")});
        const ProgramResult result = run_raylign(arguments);
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_FALSE(std::filesystem::exists(folder.path("case")));
        return result.err;
    };
    const std::vector<float> blank(kPixels * kPixels, 1000.0F);
    write_file(folder.path("d.h5"), {blank, blank});
    const std::string file = folder.path("d.h5");
    EXPECT_THAT(message({"atlas", file}), HasSubstr("deepfluoro or ljubljana"));
    EXPECT_THAT(message({"deepfluoro", folder.path("none.h5")}), HasSubstr("none.h5"));
    EXPECT_THAT(message({"deepfluoro", file, "--patient", "1"}), HasSubstr("--specimen"));
    EXPECT_THAT(message({"ljubljana", file, "--specimen", "s"}), HasSubstr("--patient"));
    EXPECT_THAT(message({"ljubljana", file}), HasSubstr("subjectNN"));
    EXPECT_THAT(message({"deepfluoro", file, "--specimen", "t"}), HasSubstr("one of s"));
    EXPECT_THAT(message({"deepfluoro", file, "--i0", "0"}), HasSubstr("--i0"));
}

}  // namespace
}  // namespace raylign::detail::test
