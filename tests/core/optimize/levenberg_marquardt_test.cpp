#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/optimize/levenberg_marquardt.h"
#include "raylign/rigid_transform.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// In one dimension: gradient 1, curvature 1. The step is then -1 / (1 + damping), and tells the damping.
LocalModel unit_slope(double cost) { return {cost, Eigen::VectorXd::Ones(1), Eigen::MatrixXd::Ones(1, 1)}; }

LevenbergMarquardtSearch unit_search(const LevenbergMarquardtOptions& options) { return {unit_slope(10), options}; }

/// Sum of squares / 2 of residuals that `f` gives with their Jacobian; the base is a plain vector.
struct LeastSquares {
    struct Value {
        Eigen::VectorXd residuals;
        Eigen::MatrixXd jacobian;
    };
    std::function<Value(const Eigen::VectorXd&)> f;
    Eigen::VectorXd base;
    std::vector<Eigen::VectorXd> visited{base};

    LevenbergMarquardtResult solve(const LevenbergMarquardtOptions& options, const StepCallback& on_step = {}) {
        const ManifoldProblem problem{[this](const Eigen::VectorXd& step) {
                                          const auto [r, j] = f(base + step);
                                          return LocalModel{r.squaredNorm() / 2, j.transpose() * r, j.transpose() * j};
                                      },
                                      [this](const Eigen::VectorXd& step) { visited.push_back(base += step); },
                                      static_cast<int>(base.size())};
        return levenberg_marquardt(problem, options, on_step);
    }
};

Eigen::VectorXd plane_point(double x, double y) { return Eigen::Vector2d(x, y); }

LeastSquares rosenbrock() {
    const auto f = [](const Eigen::VectorXd& p) {
        LeastSquares::Value value{plane_point(10 * (p[1] - p[0] * p[0]), 1 - p[0]), Eigen::MatrixXd(2, 2)};
        value.jacobian << -20 * p[0], 10, -1, 0;
        return value;
    };
    return {f, plane_point(-1.2, 1)};
}

/// [Powell62] (1, -1, 0, 1 from 3, -1, 0, 1): the Jacobian has rank 2 at the minimum, the origin.
LeastSquares powell_singular() {
    const auto f = [](const Eigen::VectorXd& p) {
        const double a = p[1] - 2 * p[2], b = p[0] - p[3], s5 = std::sqrt(5.), s10 = std::sqrt(10.);
        LeastSquares::Value value{Eigen::Vector4d(p[0] + 10 * p[1], s5 * (p[2] - p[3]), a * a, s10 * b * b),
                                  Eigen::MatrixXd(4, 4)};
        value.jacobian << 1, 10, 0, 0, 0, 0, s5, -s5, 0, 2 * a, -4 * a, 0, 2 * s10 * b, 0, 0, -2 * s10 * b;
        return value;
    };
    return {f, Eigen::Vector4d(3, -1, 0, 1)};
}

/// x^2 - c = 0: a step without damping is Newton's for the square root.
LeastSquares square_root_of(double c, double start) {
    const auto f = [c](const Eigen::VectorXd& p) {
        return LeastSquares::Value{Eigen::VectorXd::Constant(1, p[0] * p[0] - c),
                                   Eigen::MatrixXd::Constant(1, 1, 2 * p[0])};
    };
    return {f, Eigen::VectorXd::Constant(1, start)};
}

TEST(LevenbergMarquardt, TheFirstStepIsDampedAsAsked) {
    EXPECT_DOUBLE_EQ(unit_search({.initial_damping = 1}).step()[0], -1. / 2);
    EXPECT_DOUBLE_EQ(unit_search({.initial_damping = 3}).step()[0], -1. / 4);
}

TEST(LevenbergMarquardt, DampingFallsToAFifthAfterALowerCost) {
    LevenbergMarquardtSearch search = unit_search({.initial_damping = 1});
    EXPECT_TRUE(search.take(unit_slope(9)));
    EXPECT_DOUBLE_EQ(search.step()[0], -1 / 1.2);
    EXPECT_EQ(search.result().model.cost, 9);
    EXPECT_EQ(search.result().iterations, 1);
    EXPECT_DOUBLE_EQ(search.last_length(), 0.5);
}

TEST(LevenbergMarquardt, DampingRisesEightfoldAfterAHigherCost) {
    LevenbergMarquardtSearch search = unit_search({.initial_damping = 1});
    EXPECT_FALSE(search.take(unit_slope(11)));
    EXPECT_DOUBLE_EQ(search.step()[0], -1. / 9);
}

TEST(LevenbergMarquardt, AfterAHigherCostTheNextStepIsAtLeastAThirdShorter) {
    LevenbergMarquardtSearch search = unit_search({.initial_damping = 1e-6});
    EXPECT_FALSE(search.take(unit_slope(11)));
    EXPECT_DOUBLE_EQ(search.step()[0], -1 / 1.5);
}

TEST(LevenbergMarquardt, LearnsWhatLargeResidualsBend) {
    // x + 1 and q x^2 + x - 1: the minimum is at 0, where Gauss-Newton leaves out -2 q of a curvature of 2 - 2 q and
    // comes nearer by a factor of q a step alone: 18 and 37 steps to 1e-6 for 0.5 and 0.7.
    const auto f = [](const Eigen::VectorXd& p) {
        LeastSquares::Value value{
            Eigen::Vector4d(p[0] + 1, 0.5 * p[0] * p[0] + p[0] - 1, p[1] + 1, 0.7 * p[1] * p[1] + p[1] - 1),
            Eigen::MatrixXd::Zero(4, 2)};
        value.jacobian(0, 0) = value.jacobian(2, 1) = 1;
        value.jacobian(1, 0) = p[0] + 1;
        value.jacobian(3, 1) = 1.4 * p[1] + 1;
        return value;
    };
    LeastSquares problem{f, plane_point(0.2, -0.2)};
    const LevenbergMarquardtResult found = problem.solve({.step_tolerance = 1e-7, .learns = true});
    EXPECT_LT(problem.base.norm(), 1e-6);
    EXPECT_LE(found.linearizations, 14);
    problem.base = plane_point(0.2, -0.2);
    EXPECT_GT(problem.solve({.step_tolerance = 1e-7}).linearizations, 30);
}

TEST(LevenbergMarquardt, ARejectedTrialLeavesTheModelAsItWas) {
    LevenbergMarquardtSearch search = unit_search({.initial_damping = 1});
    (void)search.take(unit_slope(11));
    EXPECT_EQ(search.result().model.cost, 10);
    EXPECT_EQ(search.result().iterations, 0);
    EXPECT_EQ(search.result().linearizations, 2);
    EXPECT_EQ(search.last_length(), 0);
}

TEST(LevenbergMarquardt, AnEqualCostIsNoImprovement) { EXPECT_FALSE(unit_search({}).take(unit_slope(10))); }

TEST(LevenbergMarquardt, AStepIsNoLongerThanAllowedAndKeepsItsDirection) {
    const LocalModel model{10, plane_point(-3, -4), Eigen::MatrixXd::Identity(2, 2)};
    const LevenbergMarquardtSearch search(model, {.max_step = 0.5});
    EXPECT_NEAR((search.step() - plane_point(0.3, 0.4)).norm(), 0, 1e-15);
}

TEST(LevenbergMarquardt, AShorterStepThanTheToleranceEndsTheSearch) {
    EXPECT_FALSE(unit_search({.step_tolerance = 0.5, .initial_damping = 1}).done());
    const LevenbergMarquardtSearch search = unit_search({.step_tolerance = 0.5000001, .initial_damping = 1});
    EXPECT_TRUE(search.done());
    EXPECT_EQ(search.result().termination, Termination::converged);
}

TEST(LevenbergMarquardt, ALowerPromiseThanTheToleranceEndsTheSearch) {
    // A step of 1/2 promises 1/2 - 1/8.
    EXPECT_FALSE(unit_search({.decrease_tolerance = 0.375, .initial_damping = 1}).done());
    const LevenbergMarquardtSearch search = unit_search({.decrease_tolerance = 0.3750001, .initial_damping = 1});
    EXPECT_TRUE(search.done());
    EXPECT_EQ(search.result().termination, Termination::converged);
}

TEST(LevenbergMarquardt, CountsTheStepsTriedAgainstItsLimit) {
    LevenbergMarquardtSearch search = unit_search({.max_iterations = 3});
    (void)search.take(unit_slope(9));
    (void)search.take(unit_slope(11));
    EXPECT_FALSE(search.done());
    (void)search.take(unit_slope(8));
    EXPECT_TRUE(search.done());
    EXPECT_EQ(search.result().termination, Termination::max_iterations);
    EXPECT_EQ(search.result().iterations, 2);
    EXPECT_EQ(search.result().linearizations, 4);
}

TEST(LevenbergMarquardt, ACostThatNeverFallsConvergesOnceTheDampingIsPastAnyUse) {
    LevenbergMarquardtSearch search = unit_search({.step_tolerance = 1e-12});
    int trials = 0;
    while (!search.done()) trials += !search.take(unit_slope(11));
    EXPECT_EQ(trials, 11) << "0.5, then 0.5 * 8^10 is the first above 1e8";
    EXPECT_EQ(search.result().termination, Termination::converged);
}

TEST(LevenbergMarquardt, ANonFiniteStartEndsItAtOnce) {
    for (int part = 0; part < 3; ++part) {
        for (const double bad : {kNotANumber, std::numeric_limits<double>::infinity()}) {
            LocalModel model = unit_slope(10);
            (part == 0 ? model.cost : part == 1 ? model.gradient[0] : model.curvature(0, 0)) = bad;
            const LevenbergMarquardtSearch search(model, {});
            EXPECT_TRUE(search.done());
            EXPECT_EQ(search.result().termination, Termination::non_finite_cost) << part << " " << bad;
        }
    }
}

TEST(LevenbergMarquardt, ANonFiniteTrialEndsItWhereItStands) {
    LevenbergMarquardtSearch search = unit_search({});
    LocalModel trial = unit_slope(9);
    trial.gradient[0] = kNotANumber;
    EXPECT_FALSE(search.take(trial));
    EXPECT_TRUE(search.done());
    EXPECT_EQ(search.result().termination, Termination::non_finite_cost);
    EXPECT_EQ(search.result().model.cost, 10);
}

TEST(LevenbergMarquardt, AFlatDirectionStaysWhereItIs) {
    LocalModel model{10, plane_point(1, 0), Eigen::MatrixXd::Zero(2, 2)};
    model.curvature(0, 0) = 2;
    const LevenbergMarquardtSearch search(model, {.initial_damping = 1e-9});
    EXPECT_NEAR(search.step()[0], -0.5, 1e-8);
    EXPECT_EQ(search.step()[1], 0);
}

TEST(LevenbergMarquardt, AModelWithoutAnyCurvatureConvergesAtOnce) {
    const LevenbergMarquardtSearch search({10, plane_point(1, 1), Eigen::MatrixXd::Zero(2, 2)}, {});
    EXPECT_TRUE(search.done());
    EXPECT_EQ(search.result().termination, Termination::converged);
}

TEST(LevenbergMarquardt, SolvesAQuadraticInOneStepUpToTheDamping) {
    // Diagonal curvature, so that each direction is left by damping / (1 + damping) of its way, whatever its scale.
    const Eigen::Vector3d scale(1, 30, 0.02), way(3, -4, 12);
    for (const double damping : {1e-6, 0.25, 1.}) {
        LeastSquares problem{
            [&](const Eigen::VectorXd& p) {
                return LeastSquares::Value{scale.cwiseProduct(Eigen::Vector3d(p) - way), scale.asDiagonal()};
            },
            Eigen::Vector3d::Zero()};
        (void)problem.solve({.initial_damping = damping, .max_iterations = 1});
        EXPECT_NEAR((problem.base - way / (1 + damping)).norm(), 0, 1e-12) << damping;
    }
}

TEST(LevenbergMarquardt, FollowsRosenbrocksValleyToItsEnd) {
    LeastSquares problem = rosenbrock();
    const LevenbergMarquardtResult result = problem.solve({.step_tolerance = 1e-10});
    EXPECT_EQ(result.termination, Termination::converged);
    EXPECT_LT((problem.base - plane_point(1, 1)).norm(), 1e-9);
}

TEST(LevenbergMarquardt, NeverRaisesTheCostAndTellsEveryStep) {
    LeastSquares problem = rosenbrock();
    double last = std::numeric_limits<double>::infinity();
    int calls = 0;
    const LevenbergMarquardtResult result = problem.solve({}, [&](const OptimizerStep& step) {
        EXPECT_EQ(step.iteration, ++calls);
        EXPECT_LT(step.cost, last);
        EXPECT_NEAR(step.length, (problem.visited.end()[-1] - problem.visited.end()[-2]).norm(), 1e-12);
        last = step.cost;
        return true;
    });
    EXPECT_EQ(calls, result.iterations);
}

TEST(LevenbergMarquardt, ConvergesWithOrderTwoWhereTheResidualsVanish) {
    LeastSquares problem = square_root_of(2, 3);
    (void)problem.solve({.step_tolerance = 1e-6, .initial_damping = 1e-9});
    const auto off = [&](std::size_t i) { return problem.visited[i][0] - std::sqrt(2.); };
    ASSERT_GE(problem.visited.size(), 5u);
    // Newton's for the root: e' = e^2 / 2x, exactly. Damping adds 1e-9 e.
    for (std::size_t i = 1; i < 5; ++i) {
        EXPECT_NEAR(off(i), off(i - 1) * off(i - 1) / (2 * problem.visited[i - 1][0]), 2e-9) << i;
    }
}

TEST(LevenbergMarquardt, HalvesTheErrorWhereTheJacobianVanishesToo) {
    LeastSquares problem = square_root_of(0, 1);
    (void)problem.solve({.step_tolerance = 1e-6, .initial_damping = 1e-9});
    ASSERT_GE(problem.visited.size(), 10u);
    for (std::size_t i = 1; i < 10; ++i) EXPECT_NEAR(problem.visited[i][0] / problem.visited[i - 1][0], 0.5, 1e-8);
}

TEST(LevenbergMarquardt, ReachesPowellsSingularMinimum) {
    LeastSquares problem = powell_singular();
    const LevenbergMarquardtResult result = problem.solve({.step_tolerance = 1e-6});
    EXPECT_EQ(result.termination, Termination::converged);
    EXPECT_LT(problem.base.norm(), 1e-4);
}

TEST(LevenbergMarquardt, FindsARotationOnItsManifold) {
    // Points seen turned by 150 degrees; steps turn on the left of a base that moves.
    const Eigen::Matrix3d points = (Eigen::Matrix3d() << 1, 0, 2, 0, 3, 1, -1, 1, 0).finished();
    Twist turn = Twist::Zero();
    turn.head<3>() = 2.618 * Eigen::Vector3d(2, -1, 2) / 3;
    const Eigen::Matrix3d truth = exp(turn).rotation, seen = truth * points;
    Eigen::Matrix3d base = Eigen::Matrix3d::Identity();
    const auto turned = [&](const Eigen::VectorXd& step) {
        Twist twist = Twist::Zero();
        twist.head<3>() = step;
        return Eigen::Matrix3d(exp(twist).rotation * base);
    };
    const auto linearize = [&](const Eigen::VectorXd& step) {
        LocalModel model{0, Eigen::VectorXd::Zero(3), Eigen::MatrixXd::Zero(3, 3)};
        const Eigen::Matrix3d now = turned(step) * points;
        for (int i = 0; i < 3; ++i) {
            const Eigen::Vector3d p = now.col(i), r = p - seen.col(i);
            Eigen::Matrix3d jacobian;  // of w x p
            jacobian << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0;
            model.cost += r.squaredNorm() / 2;
            model.gradient += jacobian.transpose() * r;
            model.curvature += jacobian.transpose() * jacobian;
        }
        return model;
    };
    const LevenbergMarquardtResult result = levenberg_marquardt(
        {linearize, [&](const Eigen::VectorXd& step) { base = turned(step); }, 3}, {.step_tolerance = 1e-9});
    EXPECT_EQ(result.termination, Termination::converged);
    EXPECT_LT((base - truth).norm(), 1e-9);
}

TEST(LevenbergMarquardt, StopsAtTheCallersWishAfterTheStepThatWasTaken) {
    LeastSquares problem = rosenbrock();
    const LevenbergMarquardtResult result = problem.solve({}, [](const OptimizerStep&) { return false; });
    EXPECT_EQ(result.termination, Termination::stopped);
    EXPECT_EQ(result.iterations, 1);
    EXPECT_EQ(problem.visited.size(), 2u);
}

TEST(LevenbergMarquardt, RefusesOptionsOutOfRangeNamingThem) {
    const std::vector<std::pair<LevenbergMarquardtOptions, const char*>> table = {
        {{.max_step = 0}, "max_step"},
        {{.max_step = kNotANumber}, "max_step"},
        {{.step_tolerance = 0}, "step_tolerance"},
        {{.step_tolerance = kNotANumber}, "step_tolerance"},
        {{.decrease_tolerance = -1e-9}, "decrease_tolerance"},
        {{.decrease_tolerance = kNotANumber}, "decrease_tolerance"},
        {{.initial_damping = 0}, "initial_damping"},
        {{.initial_damping = kNotANumber}, "initial_damping"},
        {{.max_iterations = 0}, "max_iterations"},
        {{.max_iterations = 10001}, "max_iterations"}};
    for (const auto& [options, name] : table) {
        EXPECT_THAT(test::error_of([&wrong = options] { (void)unit_search(wrong); }), testing::StartsWith(name));
    }
}

}  // namespace
}  // namespace raylign::detail
