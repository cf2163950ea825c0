#include "core/optimize/steepest_descent.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace raylign::detail {
namespace {

constexpr double kLeastCurvatureShare = 0.01;                 // keeps a flat or noisy direction from taking over
constexpr std::array kLineFactors{0.25, 0.5, 1.0, 2.0, 4.0};  // of the last step's length
constexpr double kShrink = 0.1;                               // of the length, after a line search without success

struct Differences {
    Eigen::VectorXd gradient, curvature;
    bool finite = true;
};

/// Gradient and diagonal curvature at x from one batch of 2 n points x +- h e_i.
Differences central_differences(const BatchObjective& objective, const Eigen::VectorXd& x, double cost, double h) {
    const Eigen::Index n = x.size();
    std::vector<Eigen::VectorXd> points(2 * n, x);
    for (Eigen::Index i = 0; i < n; ++i) {
        points[2 * i][i] += h;
        points[2 * i + 1][i] -= h;
    }
    std::vector<double> costs(points.size());
    objective(points, costs);
    Differences d{Eigen::VectorXd(n), Eigen::VectorXd(n)};
    for (Eigen::Index i = 0; i < n; ++i) {
        d.gradient[i] = (costs[2 * i] - costs[2 * i + 1]) / (2 * h);
        d.curvature[i] = (costs[2 * i] + costs[2 * i + 1] - 2 * cost) / (h * h);
    }
    d.finite = d.gradient.allFinite() && d.curvature.allFinite();
    return d;
}

/// Unit vector of descent, each component divided by its curvature.
Eigen::VectorXd descent_direction(const Differences& d) {
    const Eigen::VectorXd curvature = d.curvature.cwiseAbs();
    const double floor = std::max(kLeastCurvatureShare * curvature.maxCoeff(), 1e-300);
    const Eigen::VectorXd direction = -d.gradient.cwiseQuotient(curvature.cwiseMax(floor));
    const double norm = direction.norm();
    return norm > 0 ? Eigen::VectorXd(direction / norm) : direction;
}

struct LinePoint {
    double length = 0, cost = 0;
};

/// The lowest of a few lengths along a line, improved by one parabola through it and its neighbours.
class LineSearch {
public:
    LineSearch(const BatchObjective& objective, const Eigen::VectorXd& x, double cost, const Eigen::VectorXd& direction)
        : objective_(objective), x_(x), direction_(direction), points_{{0, cost}} {}

    LinePoint search(double length, double max_length) {
        std::vector<double> lengths;
        for (const double factor : kLineFactors) lengths.push_back(std::min(factor * length, max_length));
        lengths.erase(std::unique(lengths.begin(), lengths.end()), lengths.end());
        evaluate(lengths);
        if (const double vertex = parabola_vertex(); vertex > 0 && vertex < max_length) evaluate({vertex});
        return best();
    }

    [[nodiscard]] bool finite() const {
        return std::ranges::all_of(points_, [](const LinePoint& p) { return std::isfinite(p.cost); });
    }

private:
    void evaluate(const std::vector<double>& lengths) {
        std::vector<Eigen::VectorXd> points;
        for (const double length : lengths) points.push_back(x_ + length * direction_);
        std::vector<double> costs(points.size());
        objective_(points, costs);
        for (std::size_t i = 0; i < lengths.size(); ++i) points_.push_back({lengths[i], costs[i]});
        std::ranges::sort(points_, {}, &LinePoint::length);
    }

    [[nodiscard]] LinePoint best() const { return *std::ranges::min_element(points_, {}, &LinePoint::cost); }

    /// Minimum of the parabola through the best point and its neighbours; 0 where there is none.
    [[nodiscard]] double parabola_vertex() const {
        const auto lowest = std::ranges::min_element(points_, {}, &LinePoint::cost);
        if (lowest == points_.begin() || lowest + 1 == points_.end()) return 0;
        const LinePoint a = *(lowest - 1), b = *lowest, c = *(lowest + 1);
        const double left = (b.length - a.length) * (b.cost - c.cost),
                     right = (b.length - c.length) * (b.cost - a.cost);
        if (left - right == 0) return 0;
        return b.length - 0.5 * ((b.length - a.length) * left - (b.length - c.length) * right) / (left - right);
    }

    const BatchObjective& objective_;
    const Eigen::VectorXd& x_;
    const Eigen::VectorXd& direction_;
    std::vector<LinePoint> points_;  // sorted by length
};

}  // namespace

std::string SteepestDescentOptions::problem() const {
    if (!(difference_step > 0)) return "difference_step = " + number_text(difference_step) + ": must be positive";
    if (!(step_tolerance > 0)) return "step_tolerance = " + number_text(step_tolerance) + ": must be positive";
    if (!(initial_step > 0)) return "initial_step = " + number_text(initial_step) + ": must be positive";
    if (!(max_step >= initial_step)) return "max_step = " + number_text(max_step) + ": must be at least initial_step";
    if (max_iterations < 1 || max_iterations > 10000) {
        return "max_iterations = " + std::to_string(max_iterations) + ": must be in [1, 10000]";
    }
    return {};
}

SteepestDescentResult steepest_descent(const BatchObjective& objective, const Eigen::VectorXd& start,
                                       const SteepestDescentOptions& options, const SteepestDescentCallback& on_step) {
    if (const std::string fault = options.problem(); !fault.empty()) throw Error(fault);
    SteepestDescentResult result{start};
    objective({&start, 1}, {&result.cost, 1});
    const auto end = [&](Termination termination) {
        result.termination = termination;
        return result;
    };
    if (!std::isfinite(result.cost)) return end(Termination::non_finite_cost);

    double length = options.initial_step;
    while (result.iterations < options.max_iterations) {
        // Differences wider than the steps still taken would only blur the gradient.
        const double h = std::min(options.difference_step, std::max(length, options.step_tolerance));
        const Differences differences = central_differences(objective, result.point, result.cost, h);
        if (!differences.finite) return end(Termination::non_finite_cost);
        const Eigen::VectorXd direction = descent_direction(differences);
        if (direction.isZero()) return end(Termination::converged);

        LinePoint best;
        do {
            LineSearch line(objective, result.point, result.cost, direction);
            best = line.search(length, options.max_step);
            if (!line.finite()) return end(Termination::non_finite_cost);
            if (best.length == 0) length *= kShrink;
        } while (best.length == 0 && length >= options.step_tolerance);
        if (best.length == 0) return end(Termination::converged);

        result.point += best.length * direction;
        result.cost = best.cost;
        ++result.iterations;
        length = best.length;
        if (on_step && !on_step({result.iterations, result.cost, best.length}, result.point)) {
            return end(Termination::stopped);
        }
        if (length < options.step_tolerance) return end(Termination::converged);
    }
    return end(Termination::max_iterations);
}

}  // namespace raylign::detail
