#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>

#include "core/optimize/step.h"
#include "raylign/termination.h"

namespace raylign::detail {

/// Cost, gradient and a positive semidefinite model of the second derivative at one point.
struct LocalModel {
    double cost = 0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd curvature;
};

/// A problem on a manifold: `step` is measured from the current base, which `accept` moves.
struct ManifoldProblem {
    /// The model at base + step, in coordinates around there.
    std::function<LocalModel(const Eigen::VectorXd& step)> linearize;
    std::function<void(const Eigen::VectorXd& step)> accept;  ///< base <- base + step
    int dimension = 6;
};

/// Lengths are in the units of the (scaled, unitless) parameters.
struct LevenbergMarquardtOptions {
    double max_step = 25;          ///< longest step, positive
    double step_tolerance = 1e-3;  ///< converged when a step is shorter, positive
    /// Converged when the model promises a lower decrease for the next step, not negative: what kinks and rounding of
    /// the cost hide from the step length.
    double decrease_tolerance = 0;
    double initial_damping = 1e-3;  ///< share of the diagonal added to it, positive
    int max_iterations = 50;        ///< steps tried, in [1, 10000]
    /// Learns from steps what the curvature leaves out: for starts that are near a minimum. Farther away longer steps
    /// lead elsewhere.
    bool learns = false;

    /// The first fault in words, or empty.
    [[nodiscard]] std::string problem() const;
};

/// How the damping follows what steps bring; also for devices that search by themselves (Session::descend).
struct LevenbergMarquardtRule {
    static constexpr double longest_of_plain = 4;  ///< a step with what was learnt, against one without
    static constexpr double damping_down = 0.2, damping_up = 8;
    static constexpr double least_damping_up = 0.5;  ///< after a rejected step: less proposes nearly the same again
    static constexpr double least_damping = 1e-9, largest_damping = 1e8;  ///< beyond, no step reaches a tolerance
    static constexpr double least_of_diagonal = 1e-9;  ///< of its largest element, is damped everywhere
};

struct LevenbergMarquardtResult {
    LocalModel model;    ///< at the final base
    int iterations = 0;  ///< accepted steps
    int linearizations = 0;
    Termination termination = Termination::converged;
};

/// One search, step by step, so that many can share a batch of linearizations:
///   while (!search.done()) { if (search.take(linearize(search.step()))) accept(step); }
/// Solves (H + S + damping diag H) step = -gradient, accepts a step only if the cost falls (damping x 0.2, else x 8 and
/// at least 0.5), caps its length. S is zero, or what H, a Gauss-Newton matrix, leaves out, learnt from how gradients
/// change from step to step [Dennis81]: where much stays unexplained H alone comes nearer by a constant factor a step
/// only. It is used where it makes a step longer, by up to four times. Each trial is linearized at once: accepted
/// trials, the rule, then need no second evaluation. Source: [Marquardt63]; the factors from the prototype of this
/// program.
class LevenbergMarquardtSearch {
public:
    /// `model`: at the start. Throws Error for bad options.
    LevenbergMarquardtSearch(LocalModel model, const LevenbergMarquardtOptions& options);

    [[nodiscard]] bool done() const { return done_; }
    /// The step to try next, from the current base. Only while not done.
    [[nodiscard]] const Eigen::VectorXd& step() const { return step_; }
    /// Takes the model at base + step(); true if the step is accepted: the caller then moves its base.
    bool take(LocalModel trial);
    /// Ends the search from outside.
    void stop(Termination termination) { finish(termination); }
    [[nodiscard]] const LevenbergMarquardtResult& result() const { return result_; }
    [[nodiscard]] double last_length() const { return last_length_; }

private:
    void propose();
    void finish(Termination termination);

    LevenbergMarquardtOptions options_;
    LevenbergMarquardtResult result_;
    Eigen::VectorXd step_;
    Eigen::MatrixXd missing_;  ///< what the curvature leaves out, as far as steps have shown it
    double damping_, last_length_ = 0;
    bool done_ = false;
};

/// One search to its end.
[[nodiscard]] LevenbergMarquardtResult levenberg_marquardt(const ManifoldProblem& problem,
                                                           const LevenbergMarquardtOptions& options,
                                                           const StepCallback& on_step = {});

}  // namespace raylign::detail
