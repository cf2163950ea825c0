#include "core/validation/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/validation/compare_scene.h"
#include "core/validation/differences.h"
#include "raylign/targets.h"

namespace raylign::detail {
namespace {

using validation::Largest;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kSweepSamples = 17;            // a parabola needs three; the rest shows the valley in the report
constexpr double kSweepStep = 0.5;           // mm or deg
constexpr double kDifferenceStep_mm = 0.02;  // the least of truncation, kinks and rounding of float images
constexpr double kEqualCosts = 0x1p-24;      // a float's rounding of a cost of one
constexpr double kFlatValley = 20;           // times the tolerance: a tenth of a pixel; farther apart is elsewhere
constexpr std::array<const char*, 6> kParameters{"about x", "about y", "about z", "x", "y", "z"};

std::string pose_name(std::size_t i) { return "pose " + std::to_string(i); }

/// One run of the ladder.
class Ladder {
public:
    Ladder(const Volume& volume, std::span<const View> views, const RigidTransform& given,
           std::span<const Eigen::Vector3d> targets, const std::vector<NamedBackend>& backends,
           const CompareOptions& options)
        : volume_(volume),
          views_(views.begin(), views.end()),
          small_views_(validation::reduced(views, options.longest_side_px)),
          given_(given),
          targets_(targets.begin(), targets.end()),
          backends_(backends),
          options_(options),
          centre_ct_mm_(targets_centre_mm(targets)) {
        poses_ = validation::random_poses(given, targets, options.poses, options.spread_mm, options.seed);
        for (const Eigen::Vector3d& x : targets_) radius_mm_ += (x - centre_ct_mm_).norm();
        radius_mm_ = std::max(1.0, radius_mm_ / static_cast<double>(targets_.size()));
    }

    Comparison run() {
        try {
            climb();
        } catch (const Stopped&) {
            result_.stopped = true;
        }
        return result_;
    }

private:
    struct Stopped {};

    void climb() {
        for (std::size_t b = 0; b < backends_.size(); ++b) {
            backend_ = b;
            attempt("image", "DRR in the views' own size", [&] { full_size_images(); });
            attempt("image", "DRR, " + std::to_string(options_.longest_side_px) + " px", [&] {
                session_ = prepare(small_views_);
                small_images();
            });
            if (!session_) continue;
            attempt("sums", "weighted sums of fixed and moving image", [&] { sums(); });
            attempt("cost", "cost of a pose", [&] { costs(); });
            if (backends_[b].backend->info().has_derivatives) {
                attempt("derivatives", "gradient and Gauss-Newton matrix", [&] { derivatives(); });
            }
            attempt("sweep", "place of the minimum", [&] { sweeps(); });
            session_.reset();
            attempt("registration", "final poses from the same starts", [&] { registrations(); });
        }
    }

    [[nodiscard]] bool is_oracle() const { return backend_ == 0; }
    [[nodiscard]] std::unique_ptr<Session> prepare(const std::vector<View>& views) {
        auto session = backends_[backend_].backend->prepare({volume_, views, options_.render, options_.similarity});
        volume_layout_ = session->volume_layout();
        return session;
    }

    /// What the oracle cannot do is the caller's problem, what another backend cannot do is a disagreement.
    template <typename Work>
    void attempt(const std::string& step, const std::string& quantity, Work work) {
        if (options_.progress) {
            options_.progress(backends_[backend_].name + ": " + quantity,
                              static_cast<double>(pieces_++) / (7.0 * backends_.size()));
        }
        if (options_.stop.stop_requested()) throw Stopped{};
        try {
            work();
        } catch (const Error& error) {
            if (is_oracle() || error.kind() != ErrorKind::input) throw;
            add_row(step, quantity, "", kInfinity, 0, {0, "the backend must be able to do it"}, error.what());
        }
    }

    void add_row(const std::string& step, const std::string& quantity, const std::string& unit, double value,
                 double rms, const Tolerance& tolerance, const std::string& where) {
        result_.rows.push_back({step, quantity, backends_[0].name, backends_[backend_].name, unit, value, rms,
                                tolerance, value <= tolerance.value, where});
    }
    void add_row(const std::string& step, const std::string& quantity, const std::string& unit, const Largest& largest,
                 const Tolerance& tolerance) {
        add_row(step, quantity, unit, largest.value(), largest.rms(), tolerance, largest.where());
    }
    [[nodiscard]] CompareTolerances tolerances() const {
        return compare_tolerances(backends_[backend_].backend->info(), volume_layout_);
    }

    void images(Session& session, std::size_t poses, std::vector<Image>& oracle, const std::string& quantity) {
        Largest largest;
        for (std::size_t p = 0, i = 0; p < poses; ++p) {
            for (std::size_t v = 0; v < views_.size(); ++v, ++i) {
                Image image = session.render(poses_[p], v);
                if (is_oracle()) {
                    oracle.push_back(std::move(image));
                } else {
                    add_image(largest, image, oracle[i], pose_name(p) + ", view " + views_[v].name);
                }
            }
        }
        if (!is_oracle()) add_row("image", quantity, "of the maximum", largest, tolerances().image_share);
    }

    void full_size_images() {
        const auto poses = static_cast<std::size_t>(std::clamp(options_.full_size_poses, 0, options_.poses));
        images(*prepare(views_), poses, full_images_, "DRR in the views' own size");
    }
    void small_images() {
        images(*session_, poses_.size(), small_images_,
               "DRR, at most " + std::to_string(options_.longest_side_px) + " px");
    }

    void sums() {
        const std::vector<MomentSums> sums = session_->moment_sums(poses_);
        if (is_oracle()) {
            oracle_sums_ = sums;
            return;
        }
        Largest largest;
        const std::size_t each = sums.size() / poses_.size();
        for (std::size_t p = 0; p < poses_.size(); ++p) {
            add_sums(largest, std::span(sums).subspan(p * each, each), std::span(oracle_sums_).subspan(p * each, each),
                     pose_name(p));
        }
        add_row("sums", "sums S_w, S_B, S_BB, S_AB", "of the oracle's", largest, tolerances().sums_share);
    }

    void costs() {
        std::vector<double> costs(poses_.size());
        session_->evaluate(poses_, costs);
        if (is_oracle()) {
            oracle_costs_ = costs;
            return;
        }
        Largest largest;
        for (std::size_t p = 0; p < costs.size(); ++p) largest.add(costs[p] - oracle_costs_[p], pose_name(p));
        add_row("cost", "cost of a pose", "", largest, tolerances().cost);
    }

    /// Rotations as mm at the targets' mean distance, so that six numbers can be compared as one vector.
    [[nodiscard]] Twist scaled(const Twist& gradient) const {
        Twist result = gradient;
        result.head<3>() /= radius_mm_;
        return result;
    }
    [[nodiscard]] Twist central_differences(const RigidTransform& pose) {
        std::vector<RigidTransform> poses;
        for (int i = 0; i < 6; ++i) {
            Twist step = kDifferenceStep_mm * Twist::Unit(i);
            step.head<3>() /= radius_mm_;
            poses.push_back(exp_about(step, pose * centre_ct_mm_) * pose);
            poses.push_back(exp_about(-step, pose * centre_ct_mm_) * pose);
        }
        std::array<double, 12> costs{};
        session_->evaluate(poses, costs);
        Twist differences;
        for (std::size_t i = 0; i < 6; ++i)
            differences[i] = (costs[2 * i] - costs[2 * i + 1]) / (2 * kDifferenceStep_mm);
        return differences;
    }

    void derivatives() {
        // Takes the last poses, not the given one, where the gradient all but vanishes.
        const auto count = static_cast<std::size_t>(std::clamp(options_.derivative_poses, 1, options_.poses));
        const std::span<const RigidTransform> poses = std::span(poses_).last(count);
        std::vector<Linearization> results(count);
        session_->linearize(poses, centre_ct_mm_, results);
        if (is_oracle()) {
            oracle_linear_ = results;
            for (const RigidTransform& pose : poses) oracle_differences_.push_back(central_differences(pose));
        }
        Largest gradient, curvature, truth;
        const double to_scaled = radius_mm_;
        Eigen::DiagonalMatrix<double, 6> unit;
        unit.diagonal() << Eigen::Vector3d::Constant(1 / to_scaled), Eigen::Vector3d::Ones();
        for (std::size_t p = 0; p < count; ++p) {
            const Linearization& oracle = oracle_linear_[p];
            const std::string where = pose_name(poses_.size() - count + p);
            const Twist ours = scaled(results[p].gradient), theirs = scaled(oracle.gradient);
            gradient.add((ours - theirs).norm() / std::max(theirs.norm(), 1e-12), where);
            const Eigen::Matrix<double, 6, 6> a = unit * results[p].curvature * unit,
                                              b = unit * oracle.curvature * unit;
            curvature.add((a - b).norm() / std::max(b.norm(), 1e-12), where);
            const Twist& differences = oracle_differences_[p];
            Eigen::Index axis = 0;
            (ours - differences).cwiseAbs().maxCoeff(&axis);
            truth.add((ours - differences).norm() / std::max(differences.norm(), 1e-12),
                      where + ", most in " + kParameters[axis]);
        }
        const CompareTolerances allowed = tolerances();
        add_row("derivatives", "gradient against differences of the oracle's cost", "of its length", truth,
                allowed.differences_share);
        if (is_oracle()) return;
        add_row("derivatives", "gradient", "of its length", gradient, allowed.gradient_share);
        add_row("derivatives", "Gauss-Newton matrix", "of its norm", curvature, allowed.gradient_share);
    }

    [[nodiscard]] CompareSweep sweep(int axis) {
        CompareSweep result{backends_[backend_].name, kParameters[axis], axis < 3 ? "deg" : "mm", {}, {}, 0};
        std::vector<RigidTransform> poses;
        constexpr int kMiddle = kSweepSamples / 2;
        for (int i = 0; i < kSweepSamples; ++i) {
            result.offsets.push_back((i - kMiddle) * kSweepStep);
            const double unit = axis < 3 ? kRadPerDeg : 1;
            poses.push_back(exp_about(result.offsets.back() * unit * Twist::Unit(axis), given_ * centre_ct_mm_) *
                            given_);
        }
        result.costs.resize(poses.size());
        session_->evaluate(poses, result.costs);
        result.minimum = validation::minimum_by_parabola(result.offsets, result.costs);
        return result;
    }
    void sweeps() {
        for (int axis = 0; axis < 6; ++axis) {
            result_.sweeps.push_back(sweep(axis));
            const CompareSweep &ours = result_.sweeps.back(), &oracle = result_.sweeps[static_cast<std::size_t>(axis)];
            if (is_oracle() || std::isnan(oracle.minimum)) continue;  // nothing to agree on
            const double apart = std::abs(ours.minimum - oracle.minimum);
            add_row("sweep", "place of the minimum, " + ours.parameter, ours.unit,
                    std::isnan(apart) ? kInfinity : apart, 0, tolerances().sweep_mm_or_deg,
                    std::isnan(apart) ? "no minimum within the sweep" : "");
        }
    }

    /// Where the valley is so flat that the rounding of costs moves its floor, two engines may end at different places
    /// of it: as good if the oracle cannot tell them apart.
    [[nodiscard]] bool equally_good(const RigidTransform& a, const RigidTransform& b) {
        if (!oracle_session_) {
            oracle_session_ =
                backends_[0].backend->prepare({volume_, small_views_, options_.render, options_.similarity});
        }
        std::array<double, 2> costs{};
        oracle_session_->evaluate(std::array{a, b}, costs);
        return std::abs(costs[0] - costs[1]) <= kEqualCosts;
    }

    void registrations() {
        const Tolerance allowed =
            validation::for_pixels(tolerances().pose_mtre_mm, small_views_, given_ * centre_ct_mm_);
        Largest apart, apart_in_flat_valleys;
        for (int i = 0; i < options_.registrations; ++i) {
            const RegistrationResult found = registered(i);
            if (is_oracle()) oracle_poses_.push_back(found.world_from_ct);
            const RigidTransform& oracle = oracle_poses_[i];
            const double mtre_mm = mean_target_error_mm(found.world_from_ct, oracle, targets_);
            result_.registrations.push_back({backends_[backend_].name, i, found.world_from_ct,
                                             mean_target_error_mm(found.world_from_ct, given_, targets_), mtre_mm,
                                             found.cost_final, found.iterations, found.total_s, ""});
            const bool flat = mtre_mm > allowed.value && mtre_mm <= kFlatValley * allowed.value &&
                              equally_good(found.world_from_ct, oracle);
            (flat ? apart_in_flat_valleys : apart).add(mtre_mm, "start " + std::to_string(i));
        }
        if (is_oracle() || options_.registrations <= 0) return;
        const std::string quantity = "final poses from the same starts";
        if (apart.value() > allowed.value || apart_in_flat_valleys.value() == 0) {
            add_row("registration", quantity, "mm mTRE", apart, allowed);
        } else {
            add_row(
                "registration", quantity, "mm mTRE", apart_in_flat_valleys,
                {apart_in_flat_valleys.value(), "a flat valley: the oracle's costs at both differ by 2^-24 at most"});
        }
    }

    [[nodiscard]] RegistrationResult registered(int i) {
        RegistrationOptions options;
        options.method = options_.method;
        options.similarity = options_.similarity;
        options.render = options_.render;
        options.suspect_mirrored = false;
        const RigidTransform start =
            perturbed_start(given_, targets_, options_.start_mtre_mm, Random(options_.seed + 1 + i).bits());
        RegistrationResult found = register_volume(volume_, small_views_, start, options, *backends_[backend_].backend,
                                                   {.stop = options_.stop});
        if (found.termination == Termination::stopped) throw Stopped{};
        return found;
    }

    const Volume& volume_;
    std::vector<View> views_, small_views_;
    RigidTransform given_;
    std::vector<Eigen::Vector3d> targets_;
    const std::vector<NamedBackend>& backends_;
    const CompareOptions& options_;
    Eigen::Vector3d centre_ct_mm_;
    double radius_mm_ = 0;
    std::vector<RigidTransform> poses_;
    std::size_t backend_ = 0;
    int pieces_ = 0;
    std::unique_ptr<Session> session_, oracle_session_;
    std::string volume_layout_;  ///< of the backend's last session
    std::vector<Image> full_images_, small_images_;
    std::vector<MomentSums> oracle_sums_;
    std::vector<double> oracle_costs_;
    std::vector<Linearization> oracle_linear_;
    std::vector<Twist> oracle_differences_;
    std::vector<RigidTransform> oracle_poses_;
    Comparison result_;
};

}  // namespace

bool Comparison::agrees() const {
    return !stopped && !rows.empty() && std::ranges::all_of(rows, [](const CompareRow& row) { return row.agrees; });
}

Comparison compare_backends(const Volume& volume, std::span<const View> views, const RigidTransform& world_from_ct,
                            std::span<const Eigen::Vector3d> targets_ct_mm, const std::vector<NamedBackend>& backends,
                            const CompareOptions& options) {
    validation::check(backends, options);
    return Ladder(volume, views, world_from_ct, targets_ct_mm, backends, options).run();
}

}  // namespace raylign::detail
