#include <gmock/gmock.h>

#include <array>

#include "io_files.h"
#include "raylign/io/pose.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::AllOf;
using testing::HasSubstr;

class ItkTransform : public test::IoTest {
protected:
    /// A file of these transforms: type, parameters, fixed parameters.
    std::filesystem::path file(const std::vector<std::array<std::string, 3>>& transforms) const {
        std::string text = "#Insight Transform File V1.0\n";
        for (std::size_t i = 0; i < transforms.size(); ++i) {
            const auto& [type, parameters, fixed] = transforms[i];
            text += "#Transform " + std::to_string(i) + "\nTransform: " + type + "_double_3_3\n";
            if (type != "CompositeTransform") {
                text += "Parameters: " + parameters + "\nFixedParameters: " + fixed + "\n";
            }
        }
        return write("t.tfm", text);
    }
    std::string message(const std::string& type, const std::string& parameters, const std::string& fixed = "0 0 0") {
        return error_of([&] { (void)read_pose(file({{type, parameters, fixed}})); });
    }
};

TEST_F(ItkTransform, TooFewAndTooManyParametersAreCounted) {
    for (const auto& [type, count] : {std::pair{"TranslationTransform", 3},
                                      {"Euler3DTransform", 6},
                                      {"VersorTransform", 3},
                                      {"VersorRigid3DTransform", 6},
                                      {"QuaternionRigidTransform", 7},
                                      {"Similarity3DTransform", 7},
                                      {"CenteredEuler3DTransform", 9},
                                      {"AffineTransform", 12},
                                      {"Rigid3DTransform", 12},
                                      {"MatrixOffsetTransformBase", 12}}) {
        for (const int given : {0, 1, count - 1, count + 1}) {
            std::string parameters;
            for (int i = 0; i < given; ++i) parameters += "0 ";
            EXPECT_THAT(message(type, parameters),
                        AllOf(HasSubstr("t.tfm"), HasSubstr(type), HasSubstr("= " + std::to_string(given) + " in "),
                              HasSubstr("must be " + std::to_string(count))));
        }
    }
}

TEST_F(ItkTransform, BadNumbersAndFixedParametersAreNamed) {
    EXPECT_THAT(message("TranslationTransform", "1 2 nan"), AllOf(HasSubstr("line 4"), HasSubstr("nan")));
    EXPECT_THAT(message("TranslationTransform", "1 2 3O"), HasSubstr("3O"));
    EXPECT_THAT(message("Euler3DTransform", "0 0 0 1 2 3", "1 2"), HasSubstr("number of fixed parameters"));
    EXPECT_THAT(message("Rigid3DTransform", "2 0 0 0 1 0 0 0 1 0 0 0"), HasSubstr("t.tfm"));
    EXPECT_THAT(message("Euler2DTransform", "0 0 0"), HasSubstr("transform type"));
    EXPECT_THAT(message("BSplineTransform", std::string(1000, '1')), HasSubstr("parameter = 1111"));
    std::string many;
    for (int i = 0; i < 100000; ++i) many += "1 ";
    EXPECT_THAT(message("DisplacementFieldTransform", many), HasSubstr("at most 64 parameters"));
}

TEST_F(ItkTransform, MatrixOffsetBaseIsReadAsAffine) {
    const std::string matrix = "0 -1 0 1 0 0 0 0 1 10 20 30";
    for (const std::string type : {"MatrixOffsetTransformBase", "AffineTransform", "Rigid3DTransform"}) {
        EXPECT_LT(
            (read_pose(file({{type, matrix, "0 0 0"}})) * Eigen::Vector3d(8, 21, 33) - Eigen::Vector3d(1, 2, 3)).norm(),
            1e-12)
            << type;
    }
}

TEST_F(ItkTransform, TheLastPartOfSeveralIsAppliedFirst) {
    // ct = shift(turn(world)): a quarter about z, then 10 mm along x.
    const std::array<std::string, 3> shift{"TranslationTransform", "10 0 0", ""};
    const std::array<std::string, 3> turn{"Euler3DTransform", "0 0 1.5707963267948966 0 0 0", "0 0 0"};
    const std::array<std::string, 3> composite{"CompositeTransform", "", ""};
    EXPECT_LT((read_pose(file({composite, shift, turn})) * Eigen::Vector3d(8, 1, 3) - Eigen::Vector3d(1, 2, 3)).norm(),
              1e-12);
    EXPECT_LT((read_pose(file({shift, turn})) * Eigen::Vector3d(8, 1, 3) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
    EXPECT_LT((read_pose(file({turn, shift})) * Eigen::Vector3d(-2, 11, 3) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST_F(ItkTransform, APartThatIsNotRigidIsNumbered) {
    const auto error = [&](const std::vector<std::array<std::string, 3>>& transforms) {
        return error_of([&] { (void)read_pose(file(transforms)); });
    };
    const std::array<std::string, 3> composite{"CompositeTransform", "", ""},
        shift{"TranslationTransform", "1 2 3", ""};
    EXPECT_THAT(error({composite, shift, {"AffineTransform", "1 0.5 0 0 1 0 0 0 1 0 0 0", "0 0 0"}}),
                AllOf(HasSubstr("transform 2"), HasSubstr("orthonormal")));
    EXPECT_THAT(error({composite}), HasSubstr("no transform"));
    EXPECT_THAT(error({composite, composite, shift}), HasSubstr("CompositeTransform within"));
    EXPECT_THAT(error({composite, shift, {"TranslationTransform", "1", ""}}), HasSubstr("transform 2"));
}

TEST_F(ItkTransform, ADamagedHeapOfNamesIsAnError) {
    (void)test::write_itk_pair(at("pair.h5"), Eigen::Vector3d::Zero());
    const RigidTransform whole = read_pose(at("pair.h5"));
    const std::string bytes = test::content_of(at("pair.h5"));
    const std::size_t heap = bytes.find("GCOL");
    ASSERT_NE(heap, std::string::npos);
    for (std::size_t i = 0; i < 96; ++i) {
        std::string damaged = bytes;
        damaged[heap + i] = static_cast<char>(damaged[heap + i] ^ 0xF1);
        try {
            EXPECT_EQ(to_matrix(read_pose(write("damaged.h5", damaged))), to_matrix(whole)) << i;
        } catch (const Error& error) {
            EXPECT_THAT(error.what(), HasSubstr("damaged.h5")) << i;
        }
    }
}

TEST_F(ItkTransform, FilesOfItkAreReadAsItkAppliesThem) {
    for (const char* name : {"pair.tfm", "pair.h5", "composite.tfm", "composite.h5"}) {
        const Eigen::Vector3d world(7, -3, 2);
        const Eigen::Vector3d ct = test::write_itk_pair(at(name), world);
        EXPECT_LT((read_pose(at(name)) * ct - world).norm(), 1e-12) << name;
    }
}

}  // namespace
}  // namespace raylign::detail
