#pragma once

namespace raylign::detail {

// The bounds that more than one room decides by, each with its reason. What only one file needs stands there.

/// Cost of a view or a whole from which on the DRR explains too little: a mean correlation below one half.
inline constexpr double kWeakCost = 0.5;
/// Cost of a whole on the coarsest level, where noise is averaged away, from which on finer levels would be wasted.
inline constexpr double kHopelessCost = 0.7;
/// Cost of a part's only view from which on it is doubted: other tissue is expected, but this is what unrelated edges
/// reach. Of several views: trust/verdict.cpp.
inline constexpr double kWeakCost_part = 0.8;
/// Cost of a part on a level, the mean of its views, from which on it will be doubted whatever comes: no finer level
/// has been seen to make up for 0.15. What is left to do is done with few iterations.
inline constexpr double kHopelessCost_part = kWeakCost_part + 0.15;
/// Cost below which noise is all that is left: weights would only cost time.
inline constexpr double kRobustFrom_cost = 0.005;
/// Cost of a CT whose cut sides hide a part of the X-ray. Leaving out what they hide lets wrong places fit: right poses
/// of cut chests, heads and a pelvis had at most 0.36, a pelvis 24 mm away 0.53.
inline constexpr double kPoorCost_cut = 0.45;
/// Share of a part that every view must show: a sliver of it fits an edge of the field of view better than any bone
/// fits a bone.
inline constexpr double kLeastSeen_part = 0.5;

/// What a search covers where its options do not say.
inline constexpr double kNearRange_mm = 20, kNearTurn_deg = 60, kGlobalTurn_deg = 45;
inline constexpr int kNearStarts = 6144, kGlobalStarts = 8192;

/// Ends of searches closer than this are the same, in pixels at the object.
inline constexpr double kDistinct_px = 3;
/// Iterations of a candidate on one level of a search; the result has all that the options allow.
inline constexpr int kSearchIterations = 15;

/// Around a part once its place is known, at the object: what lies beyond has no weight.
inline constexpr double kDomainMargin_mm = 12;
/// Width of the Gaussian that gradients are evened out by, at the object: a cortical edge and its surroundings.
inline constexpr double kNormalisation_mm = 6;

}  // namespace raylign::detail
