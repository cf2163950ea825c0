#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace raylign::detail {

/// The fields of a NIfTI-1 or NIfTI-2 header that are used, in its own frame (RAS) and unit. Names as in nifti1.h.
struct NiftiHeader {
    bool is_big_endian = false;
    bool is_single_file = true;  ///< "n+1", "n+2": the voxels follow in the same file
    bool is_second = false;      ///< NIfTI-2
    std::vector<int> size;
    int datatype = 0;
    std::array<double, 4> pixdim{};  ///< [0] is qfac
    double vox_offset = 0, scl_slope = 0, scl_inter = 0;
    int xyzt_units = 0, qform_code = 0, sform_code = 0;
    Eigen::Vector3d quaternion, qoffset;  ///< b, c, d
    Eigen::Matrix<double, 3, 4> srow;
    std::filesystem::path header_file, voxel_file;
    std::string extension;  ///< what lies between the header and the voxels, or after the header of two files
};

/// Reads the header that belongs to `path`: of foo.img it is foo.hdr. Throws Error for other formats, Analyze among
/// them, which does not say where the volume lies, and for sizes and an offset out of range.
[[nodiscard]] NiftiHeader read_nifti_header(const std::filesystem::path& path);

}  // namespace raylign::detail
