#pragma once

namespace raylign::detail::test {

/// Float32 backends against the double reference, as a share of the image's maximum: some 500 float additions of one
/// sign a ray (about 512 * 2^-24 = 3e-5 worst case, far less on average) and float sample positions (2^-15 voxel at
/// 512).
inline constexpr double kFloatImageShare = 1e-5;

/// Costs of two backends: image differences of 1e-5 of one sign largely cancel in the correlation.
inline constexpr double kCost = 1e-5;

/// Final poses of two backends from one start [mm mTRE]: the optimizer's own tolerance, far below any accuracy claim.
inline constexpr double kPoseMtre_mm = 0.01;

/// Voxels rounded to 16 bits: half a step of 2^-16 each way, of independent sign along a ray; beside the float sums.
inline constexpr double kInt16ImageShare = 1.5e-5;

/// Fractions of 15 bits between two int16 voxels of a row (AVX2, NEON): j / 32767 stands for [j, j + 1) / 32768, off by
/// 2^-15 at most, and by nothing on average over j. As a share of the step between the two, where all samples of a ray
/// have the same fraction; and the float sums.
inline constexpr double kInt16FractionShare = 0x1p-15 + 1e-6;

/// The same on the small scene of 5 mm voxels, whose valley is so flat that the float rounding of the costs (1e-8)
/// moves its floor: Gauss-Newton ends 0.000 to 0.020 mm apart, by seed and backend. A hundredth of a voxel. Kernels of
/// four lanes end 0.000 to 0.152 mm apart on eight seeds (NEON under QEMU, and SSE2 alike), at costs that differ by
/// 3e-8.
#ifdef __aarch64__
inline constexpr double kCoarsePoseMtre_mm = 0.2;
#else
inline constexpr double kCoarsePoseMtre_mm = 0.05;
#endif

/// kPoseMtre_mm by steepest descent, which creeps along the flat valley of a small noisy scene and stops anywhere in
/// it: starts of the reference alone end 0.16 mm apart at 5 mm voxels, at costs that differ by 6e-8. An eighth of a
/// voxel.
inline constexpr double kSteepestPoseMtre_mm = 0.6;

/// Minimum of a sweep [mm or degrees]: sums in double (as `compare` allows floats; 1.3e-3 where a driver divides by the
/// reciprocal), and sums that travel as floats (20 bytes a channel, as in the
/// paper), whose rounding of 6e-8 shows in the flattest directions.
inline constexpr double kSweepMinimum = 2e-3;
inline constexpr double kSweepMinimumOfFloatSums = 2e-2;

// Accuracy that has been reached, so that a tenfold loss fails long before a test's bound on success: three times the
// median error [mm mTRE], or less where said. Recorded on x86-64 (AVX-512) by printing the tests' own errors for their
// seed and the four after it; a test without a seed gives one figure.

/// The small spine of 5 mm voxels on the reference backend, from 8 mm: 0.58 (0.57 to 0.71).
inline constexpr double kSmallSpineMtre_mm = 1.75;

/// There, Gauss-Newton against steepest descent: 0.0018, but 0.144 for the test's own seed, where the descent stops in
/// the flat valley. One and a half times the latter.
inline constexpr double kTwoMethodsMtre_mm = 0.22;

/// The spine of 1.25 mm voxels, 10^6 photons, found anywhere: 0.064 (0.063 to 0.064).
inline constexpr double kFoundSpineMtre_mm = 0.19;

/// One of its vertebrae among the others: 0.136 from 8 mm (0.122 to 0.143), 0.133 from 55 mm.
inline constexpr double kVertebraMtre_mm = 0.41;

/// The spine crossed by metal, robust weights, no noise: 0.0017, plain weights 1.7. What robust weights leave is the
/// last renewal, which moves the rim by less than 0.02 pixels.
inline constexpr double kSpineWithMetalMtre_mm = 0.003;

/// The chest at 256^2 pixels, 20,000 photons, from 8 mm: 0.0285 for each of the seeds 1 to 3.
inline constexpr double kChestMtre_mm = 0.085;

/// The wrist's radius from its reference, which is itself known to 0.15 mm and 1.4 degrees only: the centre 0.15 and
/// 0.10 mm, the turn 1.0 and 0.5 degrees at the instants 2 and 99. Three times, and twice, the larger.
inline constexpr double kWristCentre_mm = 0.46, kWristTurn_deg = 2;

/// A frame of the tracked spine, 4 mm voxels and pixels, 20,000 photons: 0.55 over the path's frames (0.18 to 1.09),
/// 0.27 to 0.37 in the other tests. Less than three times the former.
inline constexpr double kTrackedFrameMtre_mm = 1.5;

/// Nearest of the poses that templates give, before any refinement [mm at the rim]: 0.67 where only the place is
/// sought; 2.8 with turns of 6.5 degrees at a rim of 30 mm; 2.8 over the whole field, where perspective changes on the
/// way. The latter two a little less than three times.
inline constexpr double kTemplatePlace_mm = 2, kTemplateTurn_mm = 6, kTemplateField_mm = 8;

/// The same where the lattice was made wider for memory: 3.6. One pixel and a half at the object, and 1.3 times that.
inline constexpr double kTemplateWideLattice_mm = 4.7;

/// Best of 600 poses around the truth, unrefined [mm at the rim]: 0.17.
inline constexpr double kBestOfSample_mm = 0.5;

}  // namespace raylign::detail::test
