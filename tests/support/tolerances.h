#pragma once

namespace raylign::test {

/// Float32 engines against the double reference, as a share of the image's maximum: some 500 float additions of one
/// sign a ray (about 512 * 2^-24 = 3e-5 worst case, far less on average) and float sample positions (2^-15 voxel at
/// 512).
inline constexpr double kFloatImageShare = 1e-5;

/// Costs of two engines: image differences of 1e-5 of one sign largely cancel in the correlation.
inline constexpr double kCost = 1e-5;

/// Final poses of two engines from one start [mm mTRE]: the optimizer's own tolerance, far below any accuracy claim.
inline constexpr double kPoseMtre_mm = 0.01;

}  // namespace raylign::test
