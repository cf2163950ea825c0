#include "raylign/io/pose.h"

#include <gmock/gmock.h>

#include <cmath>

#include "dicom_files.h"
#include "io_files.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::HasSubstr;

class PoseIo : public test::IoTest {};

RigidTransform some_pose() {
    Twist twist;
    twist << 0.3, -1.1, 0.7, 12.345678901234567, -8.75, 1.0 / 3;
    return exp(twist);
}

double difference(const RigidTransform& a, const RigidTransform& b) {
    return (to_matrix(a) - to_matrix(b)).cwiseAbs().maxCoeff();
}

/// Reading makes the rotation exactly orthonormal again, which moves it by a few rounding errors.
constexpr double kRounding = 1e-14;

TEST_F(PoseIo, JsonRoundTripIsExact) {
    write_pose(at("pose.json"), some_pose());
    EXPECT_LT(difference(read_pose(at("pose.json")), some_pose()), kRounding);
}

TEST_F(PoseIo, TfmRoundTripKeepsFullDoublePrecision) {
    write_pose(at("pose.tfm"), some_pose());
    EXPECT_LT(difference(read_pose(at("pose.tfm")), some_pose()), kRounding);
    EXPECT_THAT(test::content_of(at("pose.tfm")), AllOf(HasSubstr("#Insight Transform File V1.0\n"),
                                                        HasSubstr("Transform: AffineTransform_double_3_3\n")));
}

TEST_F(PoseIo, TfmHoldsTheInverseOfThePose) {
    write_pose(at("pose.tfm"), some_pose());
    const std::string text = test::content_of(at("pose.tfm"));
    const std::string key = "Parameters:";
    std::istringstream numbers(text.substr(text.find(key) + key.size()));
    Eigen::Matrix3d linear;
    Eigen::Vector3d shift;
    for (int i = 0; i < 9; ++i) numbers >> linear(i / 3, i % 3);
    for (int i = 0; i < 3; ++i) numbers >> shift[i];
    ASSERT_TRUE(numbers);
    const RigidTransform pose = some_pose();
    EXPECT_LT((linear - pose.rotation.transpose()).norm(), kRounding);
    EXPECT_LT((shift + pose.rotation.transpose() * pose.translation_mm).norm(), 1e-13);
    const Eigen::Vector3d ct(30, -40, 50);
    EXPECT_LT((linear * (pose * ct) + shift - ct).norm(), 1e-12);
}

TEST_F(PoseIo, TfmMapsWorldPointsToCtPoints) {
    const std::string text =
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        "Parameters: 0 -1 0 1 0 0 0 0 1 10 20 30\nFixedParameters: 0 0 0\n";
    const RigidTransform world_from_ct = read_pose(write("pose.tfm", text));
    EXPECT_LT((world_from_ct * Eigen::Vector3d(8, 21, 33) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST_F(PoseIo, TfmCentreOfRotationIsHonoured) {
    const std::string text =
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        "Parameters: 0 -1 0 1 0 0 0 0 1 0 0 0\nFixedParameters: 5 5 5\n";
    EXPECT_LT((read_pose(write("pose.tfm", text)) * Eigen::Vector3d(5, 5, 5) - Eigen::Vector3d(5, 5, 5)).norm(), 1e-12);
}

TEST_F(PoseIo, EulerTransformsOfItkAreRead) {
    for (const char* name : {"pose.tfm", "pose.h5"}) {
        test::write_itk_euler(at(name), 0.5, {1, 2, 3}, {10, 20, 30});
        const RigidTransform pose = read_pose(at(name));
        // x -> R (x - c) + c + t
        const Eigen::Vector3d expected(1 + 10 + 4 * std::cos(0.5), 2 + 20 + 4 * std::sin(0.5), 3 + 30 + 7);
        EXPECT_LT((pose * expected - Eigen::Vector3d(5, 2, 10)).norm(), 1e-12) << name;
    }
}

TEST_F(PoseIo, ScaledAndMirroredTransformsAreRefused) {
    const std::string head =
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters: ";
    EXPECT_THAT(
        error_of([&] { (void)read_pose(write("a.tfm", head + "2 0 0 0 1 0 0 0 1 0 0 0\nFixedParameters: 0 0 0\n")); }),
        AllOf(HasSubstr("a.tfm"), HasSubstr("orthonormal")));
    EXPECT_THAT(
        error_of([&] { (void)read_pose(write("b.tfm", head + "-1 0 0 0 1 0 0 0 1 0 0 0\nFixedParameters: 0 0 0\n")); }),
        HasSubstr("mirrors"));
    EXPECT_THAT(error_of([&] {
                    (void)read_pose(write(
                        "c.json", R"({"raylign":1,"world_from_ct":[[1,0.1,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]})"));
                }),
                AllOf(HasSubstr("world_from_ct of "), HasSubstr("c.json"), HasSubstr("orthonormal")));
}

TEST_F(PoseIo, BadTransformFilesAreNamed) {
    for (const auto& [name, text] :
         {std::pair{"a.tfm", "hello"},
          {"b.h5", "hello"},
          {"c.tfm", "#Insight Transform File V1.0\n"},
          {"d.tfm",
           "#Insight Transform File V1.0\n#Transform 0\nTransform: NoSuch_double_3_3\n"
           "Parameters: 1\nFixedParameters: 0\n"},
          {"e.tfm",
           "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
           "Parameters: 1 0 0\nFixedParameters: 0 0 0\n"},
          {"f.txt", ""},
          {"g.mat", "x"},
          {"h.json", "{}"}}) {
        const auto path = write(name, text);
        EXPECT_THAT(error_of([&] { (void)read_pose(path); }), HasSubstr(path.string()));
    }
    EXPECT_THAT(error_of([&] { (void)read_pose(at("none.json")); }), HasSubstr("does not exist"));
}

TEST_F(PoseIo, BadJsonPosesNameTheKey) {
    const auto error = [&](const std::string& text) {
        return error_of([&] { (void)read_pose(write("p.json", text)); });
    };
    EXPECT_THAT(error(R"({"raylign":1,"world_from_cd":[]})"),
                AllOf(HasSubstr("world_from_cd"), HasSubstr("did you mean \"world_from_ct\"")));
    EXPECT_THAT(error(R"({"raylign":2,"world_from_ct":[]})"), AllOf(HasSubstr("raylign = 2"), HasSubstr("must be 1")));
    EXPECT_THAT(error(R"({"raylign":1,"world_from_ct":[[1,0,0,0],[0,1,0,0],[0,0,1]]})"),
                HasSubstr("4 rows of 4 numbers"));
    EXPECT_THAT(error(R"({"raylign":1,"world_from_ct":[[1,0,0,0],[0,1,0,"x"],[0,0,1,0],[0,0,0,1]]})"),
                AllOf(HasSubstr("world_from_ct[1][3] = \"x\""), HasSubstr("a number")));
    EXPECT_THAT(error(R"({"raylign":1,"raylign":1})"), HasSubstr("given twice"));
}

TEST_F(PoseIo, OtherExtensionsAreRefusedOnWriting) {
    EXPECT_THAT(error_of([&] { write_pose(at("pose.xml"), some_pose()); }),
                AllOf(HasSubstr(".xml"), HasSubstr(".tfm")));
}

TEST_F(PoseIo, SpatialRegistrationReadsBackAndMapsTheCtToTheWorld) {
    const auto ct = write("ct.dcm", test::ct_slice(0).set(0x00200052, "UI", "1.2.9").bytes());
    write_pose(at("pose.dcm"), some_pose(), ct);
    constexpr double kDicomDigits = 1e-10;  // numbers of at most 16 characters
    EXPECT_LT(difference(read_pose(at("pose.dcm"), ct), some_pose()), kDicomDigits);
    EXPECT_LT(difference(read_pose(at("pose.dcm")), some_pose()), kDicomDigits);
    EXPECT_THAT(test::content_of(at("pose.dcm")), AllOf(HasSubstr("1.2.840.10008.5.1.4.1.1.66.1"), HasSubstr("RIGID"),
                                                        HasSubstr("1.2.9"), HasSubstr("REG")));
}

/// Another program's object: the matrix maps frame 1.2.7 to the object's, 1.2.8.
test::DicomBuilder foreign_registration(const std::string& type, const std::string& matrix) {
    test::DicomBuilder inner, registration, item, file;
    inner.set(0x0070030c, "CS", type).set(0x300600c6, "DS", matrix);
    registration.set(0x0070030a, "SQ", test::sequence_of({inner}));
    item.set(0x00200052, "UI", "1.2.7").set(0x00700309, "SQ", test::sequence_of({registration}));
    file.set(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.66.1").set(0x00200052, "UI", "1.2.8");
    return file.set(0x00700308, "SQ", test::sequence_of({item}));
}

TEST_F(PoseIo, FramesOfReferenceDecideTheDirectionOfASpatialRegistration) {
    const std::string shift = "1\\0\\0\\5\\0\\1\\0\\6\\0\\0\\1\\7\\0\\0\\0\\1";
    const auto path = write("r.dcm", foreign_registration("RIGID", shift).bytes());
    const auto ct_of = [&](const char* frame) {
        return write("ct.dcm", test::ct_slice(0).set(0x00200052, "UI", frame).bytes());
    };
    const Eigen::Vector3d shift_mm(5, 6, 7);
    EXPECT_EQ(read_pose(path, ct_of("1.2.7")).translation_mm, shift_mm);
    EXPECT_EQ(read_pose(path, ct_of("1.2.8")).translation_mm, -shift_mm);
    EXPECT_EQ(read_pose(path, write("ct.nii", "no DICOM")).translation_mm, shift_mm);
    EXPECT_THAT(error_of([&] { (void)read_pose(path, ct_of("1.2.6")); }),
                AllOf(HasSubstr("1.2.7"), HasSubstr("1.2.8"), HasSubstr("1.2.6")));
}

TEST_F(PoseIo, SpatialRegistrationsThatAreNoPoseAreRefused) {
    const auto problem = [&](const test::DicomBuilder& file) {
        return error_of([&] { (void)read_pose(write("r.dcm", file.bytes())); });
    };
    const std::string unit = "1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1";
    EXPECT_THAT(problem(foreign_registration("AFFINE", unit)), HasSubstr("= AFFINE in "));
    EXPECT_THAT(problem(foreign_registration("RIGID", "1\\2")), HasSubstr("16 finite numbers"));
    EXPECT_THAT(problem(foreign_registration("RIGID", "2" + unit.substr(1))), HasSubstr("r.dcm"));
    EXPECT_THAT(problem(test::ct_slice(0)), HasSubstr("SOPClassUID (0008,0016) = 1.2.840.10008.5.1.4.1.1.2"));
    test::DicomBuilder none = foreign_registration("RIGID", unit).erase(0x00700308);
    EXPECT_THAT(problem(none), HasSubstr("registered frames of reference = 0"));
    EXPECT_THAT(error_of([&] { write_pose(at("p.dcm"), some_pose(), write("ct.dcm", test::ct_slice(0).bytes())); }),
                HasSubstr("FrameOfReferenceUID (0020,0052) is missing"));
}

}  // namespace
}  // namespace raylign::detail
