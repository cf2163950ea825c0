#include <gtest/gtest.h>

#include <numbers>

#include "core/base/linear_algebra.h"
#include "core/registration/strategy/joint_views.h"
#include "raylign/backends.h"
#include "tests/support/scenes.h"

namespace raylign::detail {
namespace {

/// Three views of the small spine, away from the minimum; the cameras of the second and third have moved, the second
/// session was made with a part of that.
struct JointCase {
    JointCase() {
        Twist a, b;
        a << 0.01, -0.02, 0.015, 1, -2, 1.5;
        b << -0.015, 0.01, 0.02, -1, 1.5, 2;
        pose = {exp((Twist() << 0.02, 0.03, -0.01, 1.5, 2, -1).finished()) * test::oblique_pose(),
                {RigidTransform{}, exp(a), exp(b)}};
        problem.prior_rad = 1 * std::numbers::pi / 180;
        problem.prior_mm = 4;
        problem.centre_world_mm = {2, -3, 5};
        problem.radius_mm = 60;
        problem.before_batch = [] {};
        std::vector<View> views{{"AP", test::c_arm_view(0, 40), {}, {}},
                                {"LAT", test::c_arm_view(90, 40), {}, {}},
                                {"LAO", test::c_arm_view(35, 40), {}, {}}};
        const auto session = backend->prepare({volume, views, {Projector::trilinear, 1.0}, {}});
        for (std::size_t v = 0; v < views.size(); ++v) views[v].image = session->render(test::oblique_pose(), v);
        const RigidTransform halfway = exp(Twist(a / 2));
        views[1].geometry.camera_from_world = views[1].geometry.camera_from_world * inverse(halfway);
        const double noise[] = {2e-5, 5e-5, 1e-4};
        for (std::size_t v = 0; v < views.size(); ++v) {
            problem.views.push_back(
                {.session = backend->prepare({volume, std::span(views).subspan(v, 1), {}, {Metric::gc, {1.5, 4}}}),
                 .session_moved = v == 1 ? halfway : RigidTransform{},
                 .noise = noise[v],
                 .share = 1 + 0.5 * static_cast<double>(v),
                 .moves = v > 0});
        }
    }
    [[nodiscard]] double cost(const Eigen::VectorXd& step) {
        return joint_model(problem, stepped(problem, pose, step)).cost;
    }

    Volume volume = test::spine_volume(32);
    std::unique_ptr<Backend> backend = create_backend("reference").backend;
    JointProblem problem;
    JointPose pose;
};

TEST(JointViews, GradientIsTheLimitOfCentralDifferences) {
    JointCase c;
    const LocalModel model = joint_model(c.problem, c.pose);
    ASSERT_EQ(model.gradient.size(), 18);
    Eigen::VectorXd differences(18);
    const double h = 0.02;  // mm: between the kinks of interpolation and float images, as in tests/backends
    for (int i = 0; i < 18; ++i) {
        const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(18, i);
        differences[i] = (c.cost(step) - c.cost(-step)) / (2 * h);
    }
    for (int block = 0; block < 18; block += 6) {
        EXPECT_LT((model.gradient - differences).segment<6>(block).norm(), 0.02 * differences.segment<6>(block).norm())
            << "block " << block << "\n"
            << model.gradient.transpose() << "\n"
            << differences.transpose();
    }
}

TEST(JointViews, GradientOfThePriorIsExact) {
    JointCase c;
    for (JointView& view : c.problem.views) view.noise = 1e12;  // nothing but the prior is left
    const LocalModel model = joint_model(c.problem, c.pose);
    const double h = 1e-3;
    for (int i = 0; i < 18; ++i) {
        const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(18, i);
        EXPECT_NEAR(model.gradient[i], (c.cost(step) - c.cost(-step)) / (2 * h), 1e-6) << "parameter " << i;
    }
}

TEST(JointViews, MovingAllCamerasWithTheObjectChangesNoImage) {
    JointCase c;
    c.problem.prior_rad = c.problem.prior_mm = 1e6;
    const double before = joint_model(c.problem, c.pose).cost;
    const RigidTransform all = exp((Twist() << 0.1, 0.2, -0.1, 5, 3, -2).finished());
    c.pose.world_from_ct = all * c.pose.world_from_ct;
    for (RigidTransform& moved : c.pose.moved) moved = all * moved;
    EXPECT_NEAR(joint_model(c.problem, c.pose).cost, before, 1e-6 * before);
}

TEST(JointViews, WithoutCamerasIsTheSumOfTheMethod) {
    JointCase c;
    const LocalModel reduced = without_cameras(joint_model(c.problem, c.pose));
    // sum_v [H_v - H_v (H_v + P)^-1 H_v], sum_v [g_v - H_v (H_v + P)^-1 (g_v - P y_v)], view by view.
    Vector6 precision = Vector6::Constant(1 / (4.0 * 4.0));
    const double prior_at_rim_mm = c.problem.prior_rad * c.problem.radius_mm;
    precision.head<3>().setConstant(1 / (prior_at_rim_mm * prior_at_rim_mm));
    Matrix6 curvature = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    for (std::size_t v = 0; v < 3; ++v) {
        JointCase alone;
        for (std::size_t u = 0; u < 3; ++u) {
            alone.problem.views[u].moves = false;
            if (u != v) alone.problem.views[u].noise = 1e15;
        }
        const LocalModel of_view = joint_model(alone.problem, alone.pose);
        const Matrix6 h = of_view.curvature;
        const Vector6 g = of_view.gradient;
        curvature += h;
        gradient += g;
        if (v == 0) continue;  // its camera stays
        Vector6 y = camera_twist(c.pose.moved[v], c.problem.centre_world_mm);
        y.head<3>() *= c.problem.radius_mm;
        const Matrix6 sum = h + Matrix6(precision.asDiagonal());
        for (int i = 0; i < 6; ++i) curvature.col(i) -= h * solve_symmetric(sum, Vector6(h.col(i)));
        gradient -= h * solve_symmetric(sum, Vector6(g - precision.cwiseProduct(y)));
    }
    EXPECT_LT((reduced.curvature - curvature).norm(), 1e-6 * curvature.norm());
    EXPECT_LT((reduced.gradient - gradient).norm(), 1e-6 * gradient.norm());
}

TEST(JointViews, TheReducedSystemGivesTheStepOfTheWhole) {
    JointCase c;
    const LocalModel model = joint_model(c.problem, c.pose), reduced = without_cameras(model);
    const Eigen::VectorXd whole = solve_symmetric(model.curvature, model.gradient);
    const Eigen::VectorXd object = solve_symmetric(reduced.curvature, reduced.gradient);
    EXPECT_LT((whole.head<6>() - object).norm(), 1e-6 * object.norm());
}

TEST(JointViews, FindsWhereTheCamerasWere) {
    JointCase c;
    // Noise of 1e-9: the images decide. The cameras of the images are those without any move.
    for (JointView& view : c.problem.views) view.noise = 1e-9;
    const double before = joint_model(c.problem, c.pose).cost;
    const LevenbergMarquardtResult solved =
        solve_jointly(c.problem, c.pose, {.max_step = 20, .step_tolerance = 1e-3, .max_iterations = 100});
    EXPECT_EQ(solved.termination, Termination::converged);
    EXPECT_LT(solved.model.cost, before / 10);
    // What is left of 1.5 degrees and 3 mm: the other projector's edges in 5 mm voxels, a tenth of a voxel in depth
    // more.
    for (std::size_t v = 1; v < 3; ++v) {
        EXPECT_LT(rotation_angle_rad(c.pose.moved[v]), 0.005);
        EXPECT_LT((c.pose.moved[v] * c.problem.centre_world_mm - c.problem.centre_world_mm).norm(), 1);
    }
    EXPECT_EQ(to_matrix(c.pose.moved[0]), Eigen::Matrix4d::Identity()) << "it stays";
}

}  // namespace
}  // namespace raylign::detail
