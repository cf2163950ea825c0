#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/io/dicom/dicom_file.h"
#include "core/io/poses/spatial_registration.h"
#include "raylign/io/image.h"
#include "raylign/io/pose.h"
#include "tests/apps/run_program.h"
#include "tests/support/test_data.h"

namespace raylign::detail::test {
namespace {

using testing::Contains;

constexpr const char* kViews = R"({ "raylign": 1, "views": [
    { "name": "AP", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 0, "secondary_angle_deg": 0,
                               "pixel_pitch_mm": [12, 12], "size_px": [64, 32] } },
    { "name": "LAT", "c_arm": { "sad_mm": 1000, "sdd_mm": 1500, "primary_angle_deg": 60, "secondary_angle_deg": 0,
                                "pixel_pitch_mm": [12, 12], "size_px": [64, 32] } } ] })";

/// The pose that a DICOM CT was registered to is its start the next time.
TEST(DicomRegister, LeavesAPoseInDicomThatIsAStart) {
    const auto ct = test_data() / "pelvis" / "dicom";
    RAYLIGN_NEED_DATA(ct);
    const TestFolder folder;
    write_text_file(folder.path("views.json"), kViews);
    write_pose(folder.path("truth.json"), RigidTransform::translate({0, 188, 785}));
    const auto run = [&](const std::string& command, const std::string& pose_flag, const std::string& pose,
                         const std::string& views, const std::string& output) {
        return run_raylign({command, "-v", ct.string(), "--views", folder.path(views), pose_flag, folder.path(pose),
                            "-o", folder.path(output)});
    };
    ASSERT_EQ(run("drr", "--pose", "truth.json", "views.json", "xrays").exit_code, 0);
    ASSERT_LE(run("register", "--start", "truth.json", "xrays/views.json", "first").exit_code, 1);
    EXPECT_THAT(names_in(folder.folder() / "first"), Contains("pose.dcm"));
    const RigidTransform found = read_pose(folder.path("first/pose.json"));
    const RigidTransform in_dicom = read_pose(folder.path("first/pose.dcm"), ct / names_in(ct).front());
    constexpr double kDicomDigits = 1e-9;  // numbers of at most 16 characters
    EXPECT_LT((to_matrix(found) - to_matrix(in_dicom)).cwiseAbs().maxCoeff(), kDicomDigits);
    EXPECT_LE(run("register", "--start", "first/pose.dcm", "xrays/views.json", "second").exit_code, 1);
}

TEST(DicomRegister, LeavesPicturesOfOneStudyAndSeries) {
    const auto ct = test_data() / "pelvis" / "dicom";
    RAYLIGN_NEED_DATA(ct);
    const TestFolder folder;
    write_text_file(folder.path("views.json"), kViews);
    write_pose(folder.path("truth.json"), RigidTransform::translate({0, 188, 785}));
    ASSERT_EQ(run_raylign({"drr", "-v", ct.string(), "--views", folder.path("views.json"), "--pose",
                           folder.path("truth.json"), "-o", folder.path("xrays")})
                  .exit_code,
              0);
    const ProgramResult result =
        run_raylign({"register", "-v", ct.string(), "--views", folder.path("xrays/views.json"), "--start",
                     folder.path("truth.json"), "--levels", "1", "--max-iterations", "1", "--no-viewer", "--dicom-out",
                     folder.path("pacs"), "-o", folder.path("result")});
    ASSERT_LE(result.exit_code, 1) << result.err;
    EXPECT_THAT(names_in(folder.folder() / "pacs"),
                testing::UnorderedElementsAre("drr_AP.dcm", "drr_LAT.dcm", "overlay_AP.dcm", "overlay_LAT.dcm"));
    const DicomTags drr = open_dicom(folder.path("pacs/drr_AP.dcm")).tags;
    const DicomTags overlay = open_dicom(folder.path("pacs/overlay_LAT.dcm")).tags;
    for (const std::uint32_t tag : {0x0020000dU, 0x0020000eU}) {  // study and series: this CT names no study
        EXPECT_TRUE(drr.text(tag).starts_with("2.25."));
        EXPECT_EQ(drr.text(tag), overlay.text(tag));
    }
    EXPECT_NE(drr.text(0x00080018), overlay.text(0x00080018));
    EXPECT_THAT(overlay.text(0x00204000), testing::StartsWith("NOT FOR DIAGNOSIS. Verdict: "));
}

/// A file's bytes with another frame of reference.
std::string with_other_frame(const std::filesystem::path& file) {
    const std::string uid = dicom_frame_of_reference(file);
    std::string bytes = read_text(file), other = uid;
    other.back() = other.back() == '1' ? '2' : '1';
    for (std::size_t at = 0; (at = bytes.find(uid, at)) != std::string::npos; ++at)
        bytes.replace(at, uid.size(), other);
    return bytes;
}

TEST(DicomTrack, RefusesAStartOfAnotherCt) {
    const auto ct = test_data() / "pelvis" / "dicom";
    RAYLIGN_NEED_DATA(ct);
    const TestFolder folder;
    write_text_file(folder.path("views.json"), kViews);
    for (const char* image : {"ap.1.tif", "lat.1.tif"}) write_image(folder.path(image), Image(64, 32, 1.F));
    write_text_file(folder.path("other.dcm"), with_other_frame(ct / names_in(ct).front()));
    write_pose(folder.path("pose.dcm"), RigidTransform::translate({0, 188, 785}), folder.path("other.dcm"));
    const ProgramResult result =
        run_raylign({"track", "-v", ct.string(), "--views", folder.path("views.json"), "--frames",
                     "AP=" + folder.path("ap.*.tif"), "--frames", "LAT=" + folder.path("lat.*.tif"), "--start",
                     folder.path("pose.dcm"), "-o", folder.path("track")});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, testing::HasSubstr("one must be the CT's"));
}

}  // namespace
}  // namespace raylign::detail::test
