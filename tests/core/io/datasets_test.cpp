#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numeric>

#include "core/io/datasets/datasets.h"
#include "core/io/datasets/hdf5_file.h"
#include "core/io/files/output.h"
#include "dataset_files.h"
#include "io_files.h"
#include "raylign/io/image.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"
#include "raylign/io/views.h"
#include "raylign/io/volume.h"
#include "tests/support/hdf5_writer.h"

namespace raylign::detail::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr int kXrayColumns = 64, kXrayRows = 48;

/// A small file with the layout of DeepFluoro's: two projections of one specimen.
class DeepFluoro : public IoTest {
protected:
    void SetUp() override {
        IoTest::SetUp();
        intrinsic << -2000, 0, 30, 0, -2000, 20, 0, 0, 1;
        extrinsic = rigid(quarter_turn_about_z(), {1, 2, -3});
        pelvis[0] = rigid(Eigen::Matrix3d::Identity(), {10, 20, 605});
        pelvis[1] = to_matrix(exp((Twist() << 0.2, -0.1, 0.3, 15, 25, 590).finished()));
        femur = to_matrix(exp((Twist() << 0.25, -0.1, 0.3, 17, 22, 592).finished()));
        std::vector<float> ramp(kXrayColumns * kXrayRows);
        std::iota(ramp.begin(), ramp.end(), 1000.0F);
        const Hdf5Writer file(at("d.h5"));
        file.matrix("proj-params/intrinsic", intrinsic);
        file.matrix("proj-params/extrinsic", extrinsic);
        file.number<std::int64_t>("proj-params/num-cols", kXrayColumns);
        file.number<std::int64_t>("proj-params/num-rows", kXrayRows);
        file.number("proj-params/pixel-col-spacing", 0.5);
        file.number("proj-params/pixel-row-spacing", 0.5);
        write_specimen(file);
        for (int view = 0; view < 2; ++view) {
            const std::string group = "17-1882/projections/00" + std::to_string(view) + "/";
            file.array(group + "image/pixels", {kXrayRows, kXrayColumns}, ramp);
            file.matrix(group + "gt-poses/cam-to-pelvis-vol", pelvis[view]);
            file.matrix(group + "gt-poses/cam-to-left-femur-vol", view == 0 ? pelvis[0] : femur);
            file.number<std::uint8_t>(group + "gt-poses/left-femur-good-fov", view == 0 ? 0 : 1);
            file.number<std::uint8_t>(group + "rot-180-for-up", view == 0 ? 0 : 1);
            file.matrix(group + "gt-landmarks/FH-l", Eigen::Vector2d(20.5, 36.25));
            file.matrix(group + "gt-landmarks/GSN-l", Eigen::Vector2d(-3, 10));
            file.matrix(group + "gt-landmarks/GSN-r", Eigen::Vector2d(std::nan(""), 10));
        }
    }
    static void write_specimen(const Hdf5Writer& file) {
        std::vector<float> voxels(24);
        std::iota(voxels.begin(), voxels.end(), -500.0F);
        std::vector<std::uint8_t> labels(24);
        std::iota(labels.begin(), labels.end(), std::uint8_t{0});
        for (const std::string group : {"17-1882/vol", "17-1882/vol-seg/image"}) {
            file.matrix(group + "/spacing", Eigen::Vector3d(1, 2, 3));
            file.matrix(group + "/origin", Eigen::Vector3d(5, -6, -7.5));
            file.matrix(group + "/dir-mat", Eigen::Matrix3d::Identity());
        }
        file.array("17-1882/vol/pixels", {3, 2, 4}, voxels);
        file.array("17-1882/vol-seg/image/pixels", {3, 2, 4}, labels);
        file.text("17-1882/vol-seg/labels-def/1", "left-hemipelvis");
        file.text("17-1882/vol-seg/labels-def/5", "left-femur");
        file.matrix("17-1882/vol-landmarks/FH-l", kLandmark);
    }
    void import(const DatasetOptions& options = {}) const {
        const ImportedCase imported = read_deepfluoro(at("d.h5"), options);
        OutputFolder folder(at("case"));
        (void)write_case(imported, folder);
        folder.commit();
    }
    [[nodiscard]] std::filesystem::path in_case(const std::string& name) const { return at("case") / name; }
    /// K extrinsic (cam-to-bone)^-1 x / z, as the data set says it.
    [[nodiscard]] Eigen::Vector2d by_definition(const Eigen::Matrix4d& cam_to_bone) const {
        const Eigen::Vector4d x = extrinsic * cam_to_bone.inverse() * Eigen::Vector4d(13, 24, 5, 1);
        const Eigen::Vector3d pixel = intrinsic * x.head<3>();
        return pixel.head<2>() / pixel.z();
    }
    /// The pixel of the stored image on which views.json and a pose file put the landmark.
    [[nodiscard]] Eigen::Vector2d by_files(const std::string& views, std::size_t view, const std::string& pose) const {
        const ViewsFile file = read_views(in_case(views), ReadImages::never);
        Eigen::Vector2d pixel = project(file.views.at(view).geometry, read_pose(in_case(pose)) * kLandmark);
        if (file.origins[view].flip == ImageFlip::columns) pixel.x() = kXrayColumns - 1 - pixel.x();
        return pixel;
    }
    static void expect_near(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
        EXPECT_LT((a - b).norm(), 1e-6) << a.transpose() << " and " << b.transpose();
    }

    Eigen::Matrix3d intrinsic = Eigen::Matrix3d::Zero();
    Eigen::Matrix4d extrinsic, pelvis[2], femur;
};

TEST_F(DeepFluoro, ALandmarkLandsWhereTheDataSetSays) {
    import();
    // (13, 24, 5) - (10, 20, 605) = (3, 4, -600), turned and moved: (-3, 5, -603).
    const Eigen::Vector2d expected(30 + 2000 * -3 / 603.0, 20 + 2000 * 5 / 603.0);
    expect_near(by_definition(pelvis[0]), expected);
    expect_near(by_files("views.json", 0, "pose_000_pelvis.json"), expected);
    expect_near(by_files("views.json", 1, "pose_001_pelvis.json"), by_definition(pelvis[1]));
    expect_near(by_files("views_001.json", 0, "pose_001_pelvis.json"), by_definition(pelvis[1]));
    expect_near(by_files("views.json", 1, "pose_001_left-femur.json"), by_definition(femur));
    const ViewsFile views = read_views(in_case("views.json"), ReadImages::never);
    EXPECT_NEAR(views.views[0].geometry.camera.sdd_mm.value(), 1000, 1e-9);
    EXPECT_EQ(views.origins[0].flip, ImageFlip::columns) << "z points to the source: mirrored as stored";
    // One world for all views: the pelvis lies still.
    EXPECT_LT(
        (to_matrix(read_pose(in_case("pose_000_pelvis.json"))) - to_matrix(read_pose(in_case("pose_001_pelvis.json"))))
            .norm(),
        1e-9);
}

TEST_F(DeepFluoro, PixelsStayAsTheyAreAndBecomeLineIntegralsByI0) {
    import({.case_name = "17-1882", .views = {"0"}, .border_px = 2, .i0 = {}});
    const Image stored = read_xray(in_case("000.tif")).image;
    ASSERT_EQ(stored.width, kXrayColumns);
    EXPECT_EQ(stored.pixels[0], 1000);
    EXPECT_EQ(stored.pixels[5 * kXrayColumns + 7], 1000 + 5 * kXrayColumns + 7);
    const View view = read_views(in_case("views.json"), ReadImages::required).views.at(0);
    const std::size_t turned = 5 * kXrayColumns + (kXrayColumns - 1 - 7);
    EXPECT_NEAR(view.image.pixels[turned], -std::log((1000 + 5 * kXrayColumns + 7) / 65487.0), 1e-5);
    EXPECT_EQ(view.weights.pixels[turned], 1);
    EXPECT_EQ(view.weights.pixels[1 * kXrayColumns + 20], 0) << "the rim";
    EXPECT_FALSE(std::filesystem::exists(in_case("views_000.json"))) << "one view needs no file of its own";
}

TEST_F(DeepFluoro, VolumeLabelsAndLandmarksKeepTheirPlaces) {
    import();
    const Raster volume = read_raster(in_case("ct.mha"));
    EXPECT_THAT(volume.size, ElementsAre(4, 2, 3));
    EXPECT_THAT(volume.spacing_mm, ElementsAre(1, 2, 3));
    EXPECT_THAT(volume.origin_mm, ElementsAre(5, -6, -7.5));
    const float* voxels = reinterpret_cast<const float*>(volume.bytes.data());
    EXPECT_EQ(voxels[1], -499) << "columns are fastest";
    EXPECT_EQ(voxels[4], -496) << "then rows";
    const Raster labels = read_raster(in_case("labels.mha"));
    EXPECT_EQ(labels.type, PixelType::u8);
    EXPECT_EQ(labels.bytes[23], std::byte{23});
    EXPECT_EQ(content_of(in_case("labels.csv")), "label,name\n1,left-hemipelvis\n5,left-femur\n");
    const auto landmarks = read_landmarks(in_case("landmarks.csv"));
    ASSERT_EQ(landmarks.size(), 1U);
    EXPECT_EQ(landmarks[0].name, "FH-l");
    EXPECT_EQ(landmarks[0].x_ct_mm, kLandmark);
    EXPECT_EQ(read_targets(in_case("targets.json")).at(0), kLandmark);
    const auto points = read_image_points(in_case("points_000.csv"));
    ASSERT_EQ(points.size(), 1U) << "the others lie outside, or nowhere";
    EXPECT_EQ(points[0].pixel, Eigen::Vector2d(20.5, 36.25));
}

TEST_F(DeepFluoro, TheReadmeTellsWhatToHeed) {
    import();
    const std::string text = content_of(in_case("README.md"));
    EXPECT_THAT(text, HasSubstr("| 001 | 1 | pelvis, left-femur | rot-180-for-up"));
    EXPECT_THAT(text, HasSubstr("| 000 | 1 | pelvis | too little of the left-femur"));
    EXPECT_FALSE(std::filesystem::exists(in_case("pose_000_left-femur.json"))) << "no reference: too little is seen";
    EXPECT_THAT(text, HasSubstr("raylign study -v ct.mha --labels labels.mha --label 1 --views views_000.json --truth "
                                "pose_000_pelvis.json --targets targets.json"));
    EXPECT_THAT(text, HasSubstr("--views views.json --truth pose_000_pelvis.json --targets targets.json -o study_all"));
    EXPECT_THAT(text, HasSubstr("(0, 0)"));
}

TEST_F(DeepFluoro, WrongChoicesListTheRightOnes) {
    const auto message = [&](const DatasetOptions& options) { return error_of([&] { import(options); }); };
    EXPECT_THAT(message({.case_name = "18", .views = {}, .border_px = {}, .i0 = {}}), HasSubstr("one of 17-1882"));
    EXPECT_THAT(message({.case_name = "", .views = {"7"}, .border_px = {}, .i0 = {}}), HasSubstr("one of 000, 001"));
    EXPECT_THAT(message({.case_name = "", .views = {"1", "001"}, .border_px = {}, .i0 = {}}), HasSubstr("twice"));
    EXPECT_THAT(message({.case_name = "", .views = {}, .border_px = 24, .i0 = {}}), HasSubstr("less than half"));
    EXPECT_FALSE(std::filesystem::exists(at("case")));
}

/// The message for a file with something missing or wrong, made by `write`.
std::string message_for(const std::filesystem::path& path, const std::function<void(const Hdf5Writer&)>& write) {
    {
        const Hdf5Writer file(path);
        write(file);
    }
    return error_of([&] { (void)read_deepfluoro(path, {}); });
}

TEST_F(DeepFluoro, WhatIsMissingIsNamedByItsPath) {
    EXPECT_THAT(message_for(at("a.h5"), [](const Hdf5Writer& f) { f.number("other", 1.0); }),
                AllOf(HasSubstr("proj-params of "), HasSubstr("a.h5"), HasSubstr("not DeepFluoro's")));
    const auto parameters = [&](const Hdf5Writer& f) {
        f.matrix("proj-params/intrinsic", intrinsic);
        f.matrix("proj-params/extrinsic", extrinsic);
        f.number("proj-params/num-cols", 64.0);
        f.number("proj-params/num-rows", 48.0);
        f.number("proj-params/pixel-col-spacing", 0.5);
    };
    EXPECT_THAT(message_for(at("b.h5"), parameters), HasSubstr("proj-params/pixel-row-spacing of "));
    const auto specimen = [&](const Hdf5Writer& f) {
        parameters(f);
        f.number("proj-params/pixel-row-spacing", 0.5);
        f.matrix("s/projections/000/gt-poses/cam-to-pelvis-vol", pelvis[0]);
    };
    EXPECT_THAT(message_for(at("c.h5"), specimen), AllOf(HasSubstr("s/vol/pixels of "), HasSubstr("is missing")));
    EXPECT_THAT(message_for(at("d2.h5"),
                            [&](const Hdf5Writer& f) {
                                parameters(f);
                                f.number("proj-params/pixel-row-spacing", 0.7);
                            }),
                HasSubstr("by rows"));
}

TEST_F(DeepFluoro, SizesThatTheFileCannotHoldAreNotBelieved) {
    const auto hollow = [&](const Hdf5Writer& f) {
        f.matrix("proj-params/intrinsic", intrinsic);
        f.matrix("proj-params/extrinsic", extrinsic);
        f.number("proj-params/num-cols", 64.0);
        f.number("proj-params/num-rows", 48.0);
        f.number("proj-params/pixel-col-spacing", 0.5);
        f.number("proj-params/pixel-row-spacing", 0.5);
        f.matrix("s/projections/000/gt-poses/cam-to-pelvis-vol", pelvis[0]);
        f.hollow("s/vol/pixels", {60000, 60000, 60000});
    };
    EXPECT_THAT(message_for(at("e.h5"), hollow), AllOf(HasSubstr("s/vol/pixels"), HasSubstr("60000 x 60000 x 60000")));
}

TEST_F(DeepFluoro, FilesThatAreCutOffOrNoHdf5AreErrors) {
    EXPECT_THAT(error_of([&] { (void)read_deepfluoro(write("x.h5", "no such thing"), {}); }),
                HasSubstr("no HDF5 file"));
    EXPECT_THAT(error_of([&] { (void)read_deepfluoro(at("none.h5"), {}); }), HasSubstr("none.h5"));
    const std::string whole = content_of(at("d.h5"));
    for (std::size_t length = 1; length < whole.size(); length += 509) {
        const auto path = write("cut.h5", whole.substr(0, length));
        EXPECT_NE(error_of([&] { (void)read_deepfluoro(path, {}); }), "") << length;
    }
}

TEST_F(DeepFluoro, TheFileIsOpenInNoProcessButItsReaders) {
    const Hdf5File file(at("d.h5"));
    EXPECT_EQ(file.number("proj-params/num-cols"), kXrayColumns);
    EXPECT_EQ(file.text("17-1882/vol-seg/labels-def/5"), "left-femur");
    EXPECT_THAT(file.names("/"), ElementsAre("17-1882", "proj-params"));
    EXPECT_EQ(H5Fget_obj_count(static_cast<hid_t>(H5F_OBJ_ALL), H5F_OBJ_FILE), 0);
}

/// The message, or "" where all was read.
std::string message_of_reading(const std::filesystem::path& path) {
    try {
        (void)read_deepfluoro(path, {}).read_view("000");
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

TEST_F(DeepFluoro, DamagedFilesAreReadOrRefusedAndKillNothing) {
    const std::string whole = content_of(at("d.h5"));
    int read = 0, refused = 0;
    for (std::size_t place = 8; place < whole.size(); place += 1499) {
        std::string damaged = whole;
        damaged[place] = static_cast<char>(~damaged[place]);
        const std::filesystem::path path = write("damaged.h5", damaged);
        const std::string message = message_of_reading(path);
        if (message.empty()) {
            ++read;
            continue;
        }
        ++refused;
        EXPECT_THAT(message, HasSubstr("damaged.h5")) << place;
    }
    EXPECT_GT(read, 0);
    EXPECT_GT(refused, 0);
}

/// A heap of texts that ends far behind the file: HDF5 1.10 reads on.
TEST_F(DeepFluoro, ADamagedHeapOfTextsIsAnError) {
    std::string bytes = content_of(at("d.h5"));
    const std::size_t heap = bytes.find("GCOL");
    ASSERT_NE(heap, std::string::npos);
    bytes.replace(heap + 8, 8, std::string(4, '\xff') + std::string(4, '\0'));
    const std::filesystem::path path = write("heap.h5", bytes);
    EXPECT_THAT(message_of_reading(path), HasSubstr("heap.h5"));
    EXPECT_EQ(message_of_reading(at("d.h5")), "") << "the next one is read";
}

}  // namespace
}  // namespace raylign::detail::test
