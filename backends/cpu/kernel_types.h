#pragma once

#include <cstddef>
#include <cstdint>

// What the kernels and the rest of the backend hand each other: plain structs, no functions. This header is compiled
// once per instruction set, so anything with code in it would become a weak symbol that the linker may take from the
// AVX-512 file.
namespace raylign::detail::cpu {

constexpr int kTilePx = 32;  ///< side of the square of pixels that is cast at once: its slab of voxels stays in the L2
constexpr int kSlabPlanes = 16;  ///< planes that all rays of a tile pass before the next ones are touched
constexpr int kPadVoxels = 8;    ///< zeros around all that is stored, so that a footprint next to it reads zeros
constexpr int kBlockVoxels = 8;  ///< side of a block in a plane; with kSlabPlanes planes it is the unit of empty space
constexpr int kNeedPx = 4;       ///< side of the square of pixels that is cast or left out as one
/// Images are filtered and summed in bands of so many columns: what a stretch of rows of them needs stays in the L1
/// cache.
constexpr int kBandColumns = 64;
constexpr int kStretchRows = 32;  ///< rows of a band that are filtered at once
/// Rows of a band at most, of large images: only its first stretch filters rows that others filter, too.
constexpr int kBandRows = 128;
/// Gradients of a stretch, in one direction; the 80 keep several images from falling into the same sets.
constexpr int kGradientFloats = kBandColumns * kStretchRows + 80;

/// Index axes (0 = x) of a layout for rays with dominant axis i: planes, rows, columns. Neighbours along a row are
/// neighbours in memory.
constexpr int kAxisOrder[3][3] = {{0, 2, 1}, {1, 2, 0}, {2, 1, 0}};

constexpr int kParameters = 6;  ///< of a pose: rotation, translation

/// Voxels as planes of rows. Only the box [begin, end) of planes, rows and columns is there, whose begins are multiples
/// of kSlabPlanes, and kPadVoxels of zeros around it on all sides: all else is zero, and no place to read from.
struct PlaneLayout {
    const void* origin;  ///< voxel `begin`: float or int16, as the kernel says
    float unit_per_mm;   ///< attenuation that a stored 1 stands for: 1 for floats
    std::ptrdiff_t plane_stride, row_stride;
    int planes, rows, columns;  ///< of the whole volume
    int begin[3], end[3];
    /// Summed-area table of occupied blocks per slab, [slab][block_rows + 1][block_columns + 1].
    const std::int32_t* occupied;
    int block_rows, block_columns;
};

/// What one step in each pose parameter does to a frame's rays: see RayFrameDerivative.
struct FrameDerivatives {
    float source[kParameters][3], direction[kParameters][3], step_u[kParameters][3], step_v[kParameters][3];
};

/// One tile of one image. Vectors are in x, y, z voxel order; see core/geometry/ray_frame.h.
struct CastJob {
    double source[3], direction[3], step_u[3], step_v[3];
    double spacing_mm[3];
    double depth_max_mm;
    double axis_ratio;           ///< 1 + kAxisBias of core/geometry/dominant_axis.h
    double step_mm;              ///< trilinear
    PlaneLayout layouts[3];      ///< by dominant axis; those the frame does not need may be empty
    int width, height;           ///< of the image
    int x0, y0, x1, y1;          ///< the tile: x0, y0 are multiples of kTilePx
    const std::uint8_t* needed;  ///< per kNeedPx square, row-major; null: cast all
    std::ptrdiff_t needed_stride;
    float* image;
    std::ptrdiff_t image_stride;
    const FrameDerivatives* derivatives;  ///< read by the derivative kernels
    std::ptrdiff_t image_distance;        ///< they write derivative image i at image + (1 + i) * image_distance
    void* scratch;                        ///< KernelTable::scratch_bytes, 64-byte aligned
};

/// One band of one image: filter (where channels = 2) and weighted sums.
struct BandJob {
    const float* image;     ///< rows of `stride` floats; columns from width on are finite
    std::ptrdiff_t stride;  ///< of image, fixed and weights: a multiple of 16, at least width
    int width, height;
    int x0, y0, x1, y1;  ///< x0 is a multiple of kBandColumns; x1 one of 16, at most kBandColumns more
    int channels;        ///< 1: the image itself; 2: its gradients
    int radius;
    const float* smooth;      ///< taps 0..radius (symmetric)
    const float* derivative;  ///< taps 0..radius (antisymmetric)
    const float* fixed[2];
    const float* weights;             ///< 0 from column width on
    float* scratch;                   ///< see band_scratch_floats
    std::ptrdiff_t image_distance;    ///< the derivative images lie behind `image` by this
    std::ptrdiff_t scratch_distance;  ///< and each filters in scratch of its own, behind the first by this
};

/// Weighted sums of one channel over a band; the sums of the fixed image alone never change.
struct BandSums {
    double moving, moving_moving, fixed_moving;
};

/// The same with derivatives: JacobianSums of core/similarity/linearization.h without what the fixed image alone
/// decides.
struct BandDerivativeSums {
    double moving, moving_moving, fixed_moving;
    double jacobian[kParameters], fixed_jacobian[kParameters], moving_jacobian[kParameters];
    double jacobian_jacobian[kParameters * (kParameters + 1) / 2];
};

enum VoxelStorage { kFloat32, kInt16 };

/// The functions of one instruction set.
struct KernelTable {
    const char* name;
    std::size_t scratch_bytes;
    VoxelStorage storage;      ///< of the voxels that these kernels are fastest with
    bool trilinear_by_planes;  ///< cast_trilinear reads the layout of a tile's dominant axis, else only that of axis 2
    void (*cast_joseph[2])(const CastJob&) noexcept;  ///< by VoxelStorage
    void (*cast_trilinear[2])(const CastJob&) noexcept;
    void (*cast_joseph_derivatives[2])(const CastJob&) noexcept;
    void (*cast_trilinear_derivatives[2])(const CastJob&) noexcept;
    void (*sum_band)(const BandJob&, BandSums*) noexcept;  ///< fills one BandSums per channel
    void (*sum_band_derivatives)(const BandJob&, BandDerivativeSums*) noexcept;
};

}  // namespace raylign::detail::cpu
