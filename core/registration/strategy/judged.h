#pragma once

#include <span>
#include <vector>

#include "core/registration/level/level.h"
#include "core/registration/strategy/candidates.h"

namespace raylign::detail {

/// Without those of which a view shows too little of a part (kLeastSeen_part).
[[nodiscard]] std::vector<Candidate> shown_enough(const Run& run, std::vector<Candidate> candidates);

/// A part's places, each refined under weights of the pixels that it covers at its start, distinct, best first. None
/// where none comes to a finite cost on enough pixels.
[[nodiscard]] std::vector<Candidate> judged(Run& run, Level& level, std::span<const Candidate> candidates,
                                            int iterations);

/// Descents from around the best of a part's places, turned by 14 degrees and shifted by a fifth of its radius each
/// way, until none ends at a better one. Templates are turned in steps and coarse levels smooth: of a vertebra in a
/// chest a neighbouring minimum was all that came through. Adds their ends to the candidates, best first.
void look_about(Run& run, Level& level, std::vector<Candidate>& candidates);

/// Counts to the best place those near it that no ridge parts from it: one view's depth is a valley so flat that
/// descents end all along it, and an end on its way is no rival.
void join_valley(Run& run, Level& level, std::vector<Candidate>& candidates);

}  // namespace raylign::detail
