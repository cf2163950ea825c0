#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/registration/level/level.h"
#include "core/registration/strategy/search.h"

namespace raylign {

/// Finds the pose: as which content, from which starts, on which levels. Writes into the run's result; the verdict is
/// passed elsewhere (verdict.h).
class Driver {
public:
    explicit Driver(RunContext& run)
        : run_(run), result_(run.result), has_derivatives_(run.backend.info().has_derivatives) {}

    void solve();

private:
    void choose_method();
    /// Second try, where the volume as a whole explains too little. Where that comes to no end, a finished whole stays.
    void try_as_part();
    void solve_part();
    /// The result is `whole` again; what the engine did since counts.
    void go_back_to(const RegistrationResult& whole, const std::string& decision);
    /// The filter of the finest level, as given or fine.
    [[nodiscard]] GradientFilter filter_of(bool fine) const;
    [[nodiscard]] std::vector<LevelPlan> plan(Content content);

    /// Coarse to fine from the start.
    void pyramid(Content content);
    /// True where a coarse level of the whole already shows that it is a part: the finer ones would be wasted.
    [[nodiscard]] bool is_hopeless(std::size_t levels, std::size_t i, double cost) const;
    /// Begins a level with the coarser level's result, unless the start costs less here (a coarse level may have gone
    /// astray).
    void take_the_better_start(Level& level, bool has_coarser);

    /// A whole, coarse to fine from many starts.
    void search_whole(Search mode);
    [[nodiscard]] std::vector<RigidTransform> starts_of(Search mode) const;
    [[nodiscard]] double range_mm() const;
    /// The starts of least cost, refined a little, the best of them refined further.
    [[nodiscard]] std::vector<Candidate> first_candidates(Level& level, const LevelProblem& problem, Search mode);
    /// Finalists compared under weights that are fair to each: the mean of the robust weights that each would choose.
    /// What no finalist explains counts little for any.
    [[nodiscard]] std::vector<Candidate> ranked_robustly(Level& level, std::vector<Candidate> candidates,
                                                         const LevelProblem& problem);
    void report_rivals(const std::vector<Candidate>& candidates, double pixel_mm);

    /// A part: all orientations and places by templates (template_search.h), the best of them judged each on the
    /// pixels that it covers. One domain for all would compare how well each fits everything else: on a real wrist
    /// the right pose was 50th by that and first by its own pixels.
    void search_part(Search mode);
    [[nodiscard]] std::vector<Candidate> template_candidates(LevelPlan plan, Search mode);
    /// Each refined under weights of the pixels that it covers at its start, distinct, best first.
    [[nodiscard]] std::vector<Candidate> judged(Level& level, std::span<const Candidate> candidates, int iterations);
    /// Without those of which a view shows too little.
    [[nodiscard]] std::vector<Candidate> seen(std::vector<Candidate> candidates) const;
    [[nodiscard]] std::optional<Focus> focus_of(Search mode) const;
    void weigh_part(Level& level, const RigidTransform& centre) const;

    /// Base weights of a part at one level: near `centre` only, gradients evened out.
    [[nodiscard]] std::vector<Image> part_weights(Level& level, const RigidTransform& centre, double margin_mm) const;
    /// Finishes on the finest level, or on one of the same size with a fine filter where the volume as a whole leaves
    /// something unexplained: scatter, metal and other contrast bias wide gradients (0.7 mm on the chest CT) far more
    /// than fine ones (0.1 mm).
    void finish_as_it_needs(Level& level, Level* coarser);
    /// What the finest level owes once its minimum is found: robust weights, costs, confidence. `coarser` may be null.
    void finish(Level& level, Level* coarser);
    [[nodiscard]] bool is_robust(Level& level) const;
    void make_robust(Level& level);

    RunContext& run_;
    RegistrationResult& result_;
    bool has_derivatives_;  ///< of the engine: searches refine by them
    /// Cost on the finest level before the fine filter and weights that finish it: noise alone raises those.
    std::optional<double> explained_cost_;
};

/// Around the object once its place is known: at the object.
inline constexpr double kDomainMargin_mm = 12;
/// Width of the Gaussian that gradients are evened out by, at the object: a cortical edge and its surroundings.
inline constexpr double kNormalisation_mm = 6;

}  // namespace raylign
