#pragma once

namespace raylign::detail::test {

/// Float32 engines against the double reference, as a share of the image's maximum: some 500 float additions of one
/// sign a ray (about 512 * 2^-24 = 3e-5 worst case, far less on average) and float sample positions (2^-15 voxel at
/// 512).
inline constexpr double kFloatImageShare = 1e-5;

/// Costs of two engines: image differences of 1e-5 of one sign largely cancel in the correlation.
inline constexpr double kCost = 1e-5;

/// Final poses of two engines from one start [mm mTRE]: the optimizer's own tolerance, far below any accuracy claim.
inline constexpr double kPoseMtre_mm = 0.01;

/// Voxels rounded to 16 bits: half a step of 2^-16 each way, of independent sign along a ray; beside the float sums.
inline constexpr double kInt16ImageShare = 1.5e-5;

/// Texture units of GPUs interpolate with 8-bit fractions: 2^-9 of the step between two voxels each way. Images, as a
/// share of their maximum, costs, and final poses [mm mTRE].
inline constexpr double kFilterBitsShare = 5e-4;
inline constexpr double kFilterBitsCost = 1e-3;
inline constexpr double kFilterBitsPoseMtre_mm = 0.05;

/// The same on the small scene of 5 mm voxels, whose valley is so flat that the float rounding of the costs (1e-8)
/// moves its floor: Gauss-Newton ends 0.000 to 0.020 mm apart, by seed and engine. A hundredth of a voxel.
inline constexpr double kCoarsePoseMtre_mm = 0.05;

/// kPoseMtre_mm by steepest descent, which creeps along the flat valley of a small noisy scene and stops anywhere in
/// it: starts of the reference alone end 0.16 mm apart at 5 mm voxels, at costs that differ by 6e-8. An eighth of a
/// voxel.
inline constexpr double kSteepestPoseMtre_mm = 0.6;

/// Minimum of a sweep [mm or degrees]: sums in double, and sums that travel as floats (20 bytes a channel, as in the
/// paper), whose rounding of 6e-8 shows in the flattest directions.
inline constexpr double kSweepMinimum = 1e-3;
inline constexpr double kSweepMinimumOfFloatSums = 2e-2;

}  // namespace raylign::detail::test
