// The comparison must find what it exists for: small faults of a backend. Each is planted into the reference, so that
// nothing else differs.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/validation/compare.h"
#include "raylign/targets.h"
#include "tests/core/validation/faulty_backend.h"
#include "tests/support/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

constexpr double kVoxel_mm = 5;  // spine_volume(32)

class Compare : public testing::Test {
protected:
    [[nodiscard]] Comparison compare(Backend& other, const CompareOptions& options) {
        const auto oracle = create_backend("reference").backend;
        return compare_backends(volume_, views_, truth_, targets_, {{"reference", oracle.get()}, {"other", &other}},
                                options);
    }
    [[nodiscard]] Comparison compare_with(const test::Fault& fault) {
        return compare(*test::make_faulty_backend(fault), options_);
    }
    /// Steps in which something disagrees.
    static std::set<std::string> found_in(const Comparison& comparison) {
        std::set<std::string> steps;
        for (const CompareRow& row : comparison.rows) {
            if (!row.agrees) steps.insert(row.step);
        }
        return steps;
    }

    Volume volume_ = test::spine_volume(32);
    RigidTransform truth_ = test::oblique_pose();
    std::vector<View> views_ =
        test::with_exact_images(test::biplane_views(40), spine_phantom({160, 160, 160}), truth_, 100000);
    std::vector<Eigen::Vector3d> targets_ = default_targets_ct_mm(volume_);
    CompareOptions options_{.poses = 4, .derivative_poses = 2, .registrations = 0};
};

TEST_F(Compare, ABackendAgreesWithItself) {
    options_.registrations = 1;
    const Comparison same = compare_with({});
    EXPECT_TRUE(same.agrees());
    for (const CompareRow& row : same.rows) {
        if (row.other == "reference") continue;  // the oracle's own derivatives against differences: not zero
        if (row.quantity.find("differences") == std::string::npos) {
            EXPECT_EQ(row.value, 0) << row.quantity;
        }
    }
    std::set<std::string> steps;
    for (const CompareRow& row : same.rows) steps.insert(row.step);
    EXPECT_EQ(steps, (std::set<std::string>{"image", "sums", "cost", "derivatives", "sweep", "registration"}));
    EXPECT_EQ(same.sweeps.size(), 12U) << "six parameters, two backends";
    EXPECT_EQ(same.registrations.size(), 2U);
}

TEST_F(Compare, TheCpuBackendAgreesWithTheReference) {
    RAYLIGN_MAKE_BACKEND(cpu, "cpu");
    options_.registrations = 1;
    const Comparison comparison = compare(*cpu, options_);
    for (const CompareRow& row : comparison.rows) {
        EXPECT_TRUE(row.agrees) << row.quantity << ": " << row.value << " > " << row.tolerance.value << " "
                                << row.where;
    }
}

TEST_F(Compare, EveryInstructionSetAgreesAsAUserHasIt) {  // AVX2 keeps 16 bits of its own accord
    for (const BackendStatus& status : backend_statuses()) {
        for (const InstructionSetStatus& set : status.instruction_sets) {
            if (!set.available) continue;
            const auto cpu = create_backend(status.name, {.cpu = {.instruction_set = set.set}}).backend;
            for (const CompareRow& row : compare(*cpu, options_).rows) {
                EXPECT_TRUE(row.agrees) << cpu->info().instruction_set << ", " << row.quantity << ": " << row.value
                                        << " > " << row.tolerance.value << " " << row.where;
            }
        }
    }
}

TEST_F(Compare, AHalfVoxelShiftIsFoundAndMeasured) {
    options_.registrations = 1;  // its final pose is off, too: no flat valley excuses it
    const Comparison comparison = compare_with({.in_volume = [](Volume& volume) {
        volume.grid.origin_mm += volume.grid.direction.col(0) * volume.grid.spacing_mm.x() / 2;
    }});
    EXPECT_FALSE(comparison.agrees());
    EXPECT_THAT(found_in(comparison), testing::IsSupersetOf({"image", "sums", "cost", "sweep", "registration"}));
    for (const CompareRow& row : comparison.rows) {
        if (row.quantity == "place of the minimum, x") {
            EXPECT_NEAR(row.value, kVoxel_mm / 2, 0.3);
        }
    }
}

TEST_F(Compare, AHalfPixelShiftOfTheDetectorIsFound) {
    const Comparison comparison =
        compare_with({.in_geometry = [](RayFrame& frame) { frame.direction_voxel += 0.5 * frame.step_u_voxel; }});
    EXPECT_THAT(found_in(comparison), testing::IsSupersetOf({"image", "sums", "cost", "sweep"}));
}

TEST_F(Compare, ASwappedAxisIsFound) {
    const Comparison comparison = compare_with({.in_volume = [](Volume& volume) {
        const Volume original = volume;
        const int n = volume.grid.size.x();
        for (int z = 0; z < n; ++z) {
            for (int y = 0; y < n; ++y) {
                for (int x = 0; x < n; ++x) volume.attenuation_per_mm[volume.index(x, y, z)] = original(y, x, z);
            }
        }
    }});
    EXPECT_THAT(found_in(comparison), testing::IsSupersetOf({"image", "sums", "cost"}));
}

TEST_F(Compare, AMissingStepFactorIsFoundAlthoughCostsDoNotSeeIt) {
    const Comparison comparison = compare_with({.in_volume = [](Volume& volume) {
        for (float& value : volume.attenuation_per_mm) value /= static_cast<float>(kVoxel_mm);
    }});
    EXPECT_THAT(found_in(comparison), testing::IsSupersetOf({"image", "sums"}));
    EXPECT_THAT(found_in(comparison), Not(Contains("cost"))) << "correlation does not know scale: images must tell";
}

TEST_F(Compare, AWrongSignOfTheImageIsFound) {
    const Comparison comparison = compare_with({.in_volume = [](Volume& volume) {
        for (float& value : volume.attenuation_per_mm) value = -value;
    }});
    EXPECT_THAT(found_in(comparison), testing::IsSupersetOf({"image", "sums", "cost"}));
}

TEST_F(Compare, AWrongSignOfOneDerivativeIsFoundByTheDerivativesAlone) {
    const Comparison comparison = compare_with({.in_derivatives = [](JacobianSums& sums) {
        sums.jacobian[1] = -sums.jacobian[1];
        sums.fixed_jacobian[1] = -sums.fixed_jacobian[1];
        sums.moving_jacobian[1] = -sums.moving_jacobian[1];
    }});
    EXPECT_THAT(found_in(comparison), ElementsAre("derivatives"));
    bool names_it = false;
    for (const CompareRow& row : comparison.rows) names_it |= row.where.find("about y") != std::string::npos;
    EXPECT_TRUE(names_it);
}

TEST_F(Compare, AWrongSumIsFoundThoughImagesAreRight) {
    const Comparison comparison = compare_with({.in_sums = [](MomentSums& sums) { sums.fixed_moving *= 1.001; }});
    EXPECT_THAT(found_in(comparison), Contains("sums"));
    EXPECT_THAT(found_in(comparison), Not(Contains("image")));
}

TEST_F(Compare, OnePixelThatIsNotANumberIsFoundAndItsPlaceNamed) {
    const Comparison comparison = compare_with({.in_image = [](Image& image) { image(7, 3) = NAN; }});
    EXPECT_THAT(found_in(comparison), ElementsAre("image"));
    for (const CompareRow& row : comparison.rows) {
        if (row.step == "image") {
            EXPECT_THAT(row.where, testing::HasSubstr("pixel (7, 3)"));
        }
    }
}

TEST_F(Compare, ABackendThatThrowsDisagreesAndTheRestIsStillCompared) {
    const Comparison comparison =
        compare_with({.in_derivatives = [](JacobianSums&) { throw Error("this backend has lost its derivatives"); }});
    EXPECT_THAT(found_in(comparison), ElementsAre("derivatives"));
    bool tells_why = false;
    for (const CompareRow& row : comparison.rows) tells_why |= row.where.find("lost") != std::string::npos;
    EXPECT_TRUE(tells_why);
    EXPECT_EQ(comparison.sweeps.size(), 12U);
}

TEST_F(Compare, ImagesAreHalvedToTheWantedSizeAndFullSizeOnesCompared) {
    options_.longest_side_px = 32;
    const Comparison comparison = compare_with({});
    EXPECT_TRUE(comparison.agrees());
    EXPECT_EQ(std::ranges::count(comparison.rows, std::string("image"), &CompareRow::step), 2);
}

TEST_F(Compare, BadOptionsAreRefused) {
    const auto reference = create_backend("reference").backend;
    EXPECT_THROW((void)compare_backends(volume_, views_, truth_, targets_, {{"reference", reference.get()}}, options_),
                 Error);
    for (const auto& spoil : std::vector<std::function<void(CompareOptions&)>>{
             [](CompareOptions& o) { o.poses = 0; }, [](CompareOptions& o) { o.longest_side_px = 8; },
             [](CompareOptions& o) { o.spread_mm = NAN; }, [](CompareOptions& o) { o.registrations = -1; }}) {
        CompareOptions bad = options_;
        spoil(bad);
        EXPECT_THROW((void)compare(*reference, bad), Error);
    }
    EXPECT_THROW(
        (void)compare_backends(volume_, views_, truth_, {}, {{"a", reference.get()}, {"b", reference.get()}}, options_),
        Error);
}

TEST_F(Compare, StopsWhenAsked) {
    StopSource source;
    source.request_stop();
    options_.stop = source.token();
    const Comparison comparison = compare_with({});
    EXPECT_TRUE(comparison.stopped);
    EXPECT_TRUE(comparison.rows.empty());
    EXPECT_FALSE(comparison.agrees());
}

TEST(CompareTolerances, WidenForSixteenBitsAndTextureFiltersOnly) {
    const CompareTolerances exact = compare_tolerances({});
    const CompareTolerances coarse = compare_tolerances({.storage = "int16"});
    const CompareTolerances filtered = compare_tolerances({.interpolation = "hardware"});
    EXPECT_EQ(compare_tolerances({.storage = "auto"}, "int16, 1 copy").image_share.value, coarse.image_share.value);
    EXPECT_EQ(compare_tolerances({.storage = "auto"}, "float32, 1 copy").image_share.value, exact.image_share.value);
    EXPECT_LT(exact.image_share.value, coarse.image_share.value);
    EXPECT_LT(coarse.image_share.value, filtered.image_share.value);
    EXPECT_LT(filtered.pose_mtre_mm.value, 0.1) << "far below any accuracy claim";
    for (const Tolerance& t : {exact.image_share, exact.sums_share, exact.cost, exact.gradient_share,
                               exact.differences_share, exact.sweep_mm_or_deg, exact.pose_mtre_mm}) {
        EXPECT_FALSE(t.reason.empty());
    }
}

}  // namespace
}  // namespace raylign::detail
