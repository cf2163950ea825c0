#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/base/error.h"
#include "core/optimize/bobyqa.h"

namespace raylign::detail {
namespace {

/// A tilted bowl with its minimum 0 at (1, 2, ..., n).
double bowl(const Eigen::VectorXd& x) {
    double sum = 0;
    for (int i = 0; i < x.size(); ++i) sum += (1 + i) * std::pow(x[i] - (i + 1), 2);
    return sum + 0.3 * std::pow(x.sum() - x.size() * (x.size() + 1) / 2.0, 2);
}

BatchObjective each(double (*cost)(const Eigen::VectorXd&)) {
    return [cost](std::span<const Eigen::VectorXd> points, std::span<double> costs) {
        for (std::size_t i = 0; i < points.size(); ++i) costs[i] = cost(points[i]);
    };
}

TEST(Bobyqa, FindsTheMinimumOfABowl) {
    const BobyqaResult found = bobyqa(each(bowl), Eigen::VectorXd::Zero(6), {.step_tolerance = 1e-6});
    EXPECT_EQ(found.termination, Termination::converged);
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(found.point[i], i + 1, 1e-4);
    EXPECT_NEAR(found.cost, 0, 1e-6);
    EXPECT_GT(found.iterations, 3);
}

TEST(Bobyqa, TellsItsStepsAndStopsWhenAsked) {
    int calls = 0;
    double last = 1e300;
    const BobyqaResult found =
        bobyqa(each(bowl), Eigen::VectorXd::Zero(6), {}, [&](const OptimizerStep& step, const Eigen::VectorXd& point) {
            EXPECT_EQ(step.iteration, ++calls);
            EXPECT_LT(step.cost, last);
            EXPECT_EQ(bowl(point), step.cost);
            last = step.cost;
            return calls < 4;
        });
    EXPECT_EQ(found.termination, Termination::stopped);
    EXPECT_EQ(found.iterations, 4);
}

TEST(Bobyqa, EndsOnBudgetAndOnNaN) {
    EXPECT_EQ(bobyqa(each(bowl), Eigen::VectorXd::Zero(6), {.max_evaluations = 15}).termination,
              Termination::max_iterations);
    EXPECT_EQ(
        bobyqa(each([](const Eigen::VectorXd&) { return std::nan(""); }), Eigen::VectorXd::Zero(6), {}).termination,
        Termination::non_finite_cost);
}

TEST(Bobyqa, ExceptionsOfTheObjectiveReachTheCaller) {
    const BatchObjective throws = [](std::span<const Eigen::VectorXd>, std::span<double>) {
        throw std::runtime_error("device lost");
    };
    EXPECT_THROW((void)bobyqa(throws, Eigen::VectorXd::Zero(6), {}), std::runtime_error);
}

TEST(Bobyqa, RefusesBadOptions) {
    EXPECT_THROW((void)bobyqa(each(bowl), Eigen::VectorXd::Zero(2), {.initial_step = 0}), Error);
    EXPECT_THROW((void)bobyqa(each(bowl), Eigen::VectorXd::Zero(2), {.step_tolerance = std::nan("")}), Error);
    EXPECT_THROW((void)bobyqa(each(bowl), Eigen::VectorXd::Zero(2), {.max_evaluations = 0}), Error);
}

}  // namespace
}  // namespace raylign::detail
