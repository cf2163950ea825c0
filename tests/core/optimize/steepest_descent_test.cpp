#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/optimize/steepest_descent.h"
#include "tests/support/errors.h"

namespace raylign::detail {
namespace {

BatchObjective batch_of(double (*f)(const Eigen::VectorXd&)) {
    return [f](std::span<const Eigen::VectorXd> points, std::span<double> costs) {
        for (std::size_t i = 0; i < points.size(); ++i) costs[i] = f(points[i]);
    };
}

/// 1 - exp(-d^2 / 2) over an ellipsoid whose axes differ by 10 (depth of a single view against the rest).
double narrow_valley(const Eigen::VectorXd& x) {
    const Eigen::VectorXd scale = (Eigen::VectorXd(6) << 1, 1, 1, 3, 3, 10).finished();
    const Eigen::VectorXd centre = (Eigen::VectorXd(6) << 1, -2, 0.5, 2, -1, 4).finished();
    return 1 - std::exp(-0.5 * (x - centre).cwiseQuotient(4 * scale).squaredNorm());
}

TEST(SteepestDescent, FindsTheMinimumOfANarrowValley) {
    const SteepestDescentResult result = steepest_descent(batch_of(narrow_valley), Eigen::VectorXd::Zero(6), {});
    EXPECT_EQ(result.termination, Termination::converged);
    EXPECT_LT(result.cost, 1e-7);
}

TEST(SteepestDescent, EvaluatesAllDifferencesOfAStepInOneBatch) {
    std::vector<std::size_t> batches;
    const BatchObjective objective = [&](std::span<const Eigen::VectorXd> points, std::span<double> costs) {
        batches.push_back(points.size());
        for (std::size_t i = 0; i < points.size(); ++i) costs[i] = narrow_valley(points[i]);
    };
    (void)steepest_descent(objective, Eigen::VectorXd::Zero(6), {.max_iterations = 1});
    ASSERT_GE(batches.size(), 3u);
    EXPECT_EQ(batches[0], 1u);
    EXPECT_EQ(batches[1], 12u);
    EXPECT_EQ(batches[2], 5u);
}

TEST(SteepestDescent, NeverRaisesTheCost) {
    double last = std::numeric_limits<double>::infinity();
    (void)steepest_descent(batch_of(narrow_valley), Eigen::VectorXd::Constant(6, 3), {},
                           [&](const OptimizerStep& step, const Eigen::VectorXd&) {
                               EXPECT_LT(step.cost, last);
                               last = step.cost;
                               return true;
                           });
    EXPECT_LT(last, 0.01);
}

TEST(SteepestDescent, StopsOnNonFiniteCostAtTheStartAndOnTheWay) {
    const auto nan_everywhere = batch_of([](const Eigen::VectorXd&) { return std::nan(""); });
    EXPECT_EQ(steepest_descent(nan_everywhere, Eigen::VectorXd::Zero(6), {}).termination, Termination::non_finite_cost);
    const auto nan_beyond =
        batch_of([](const Eigen::VectorXd& x) { return x[0] > 2 ? std::nan("") : -x[0] + x.tail<5>().squaredNorm(); });
    EXPECT_EQ(steepest_descent(nan_beyond, Eigen::VectorXd::Zero(6), {}).termination, Termination::non_finite_cost);
}

TEST(SteepestDescent, ReportsWhenIterationsRunOutOrTheCallerStops) {
    EXPECT_EQ(steepest_descent(batch_of(narrow_valley), Eigen::VectorXd::Zero(6), {.max_iterations = 1}).termination,
              Termination::max_iterations);
    const auto stop = [](const OptimizerStep&, const Eigen::VectorXd&) { return false; };
    EXPECT_EQ(steepest_descent(batch_of(narrow_valley), Eigen::VectorXd::Zero(6), {}, stop).termination,
              Termination::stopped);
}

TEST(SteepestDescent, AFlatObjectiveConvergesWhereItStands) {
    const auto flat = batch_of([](const Eigen::VectorXd&) { return 1.0; });
    const SteepestDescentResult result = steepest_descent(flat, Eigen::VectorXd::Constant(6, 2), {});
    EXPECT_EQ(result.termination, Termination::converged);
    EXPECT_EQ(result.iterations, 0);
    EXPECT_EQ(result.point, Eigen::VectorXd::Constant(6, 2));
}

TEST(SteepestDescent, RefusesOptionsOutOfRangeNamingThem) {
    const auto message = [](const SteepestDescentOptions& options) {
        return test::error_of(
            [&] { (void)steepest_descent(batch_of(narrow_valley), Eigen::VectorXd::Zero(6), options); });
    };
    EXPECT_NE(message({.difference_step = 0}).find("difference_step"), std::string::npos);
    EXPECT_NE(message({.initial_step = -1}).find("initial_step"), std::string::npos);
    EXPECT_NE(message({.initial_step = 2, .max_step = 1}).find("max_step"), std::string::npos);
    EXPECT_NE(message({.step_tolerance = std::nan("")}).find("step_tolerance"), std::string::npos);
    EXPECT_NE(message({.max_iterations = 0}).find("max_iterations"), std::string::npos);
}

}  // namespace
}  // namespace raylign::detail
