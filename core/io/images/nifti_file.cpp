#include "core/io/images/nifti_file.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/io/files/byte_source.h"
#include "core/io/files/text.h"
#include "core/io/images/nifti_header.h"
#include "core/io/volumes/label_names.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {
namespace {

using Affine = Eigen::Matrix<double, 3, 4>;  // RAS from voxel

std::pair<PixelType, int> nifti_type(int code, const std::string& name) {
    static const std::map<int, std::pair<PixelType, int>> kTypes = {
        {2, {PixelType::u8, 1}},     {4, {PixelType::i16, 1}},    {8, {PixelType::i32, 1}},
        {16, {PixelType::f32, 1}},   {64, {PixelType::f64, 1}},   {128, {PixelType::u8, 3}},
        {256, {PixelType::i8, 1}},   {512, {PixelType::u16, 1}},  {768, {PixelType::u32, 1}},
        {1024, {PixelType::i64, 1}}, {1280, {PixelType::u64, 1}}, {2304, {PixelType::u8, 4}}};
    static const std::map<int, std::string> kOthers = {{1, "bits"},
                                                       {32, "complex numbers"},
                                                       {1536, "128-bit floats"},
                                                       {1792, "complex numbers"},
                                                       {2048, "complex numbers"}};
    const auto found = kTypes.find(code);
    if (found != kTypes.end()) return found->second;
    const auto other = kOthers.find(code);
    throw bad_value("datatype", std::to_string(code) + (other == kOthers.end() ? "" : " (" + other->second + ")"),
                    "integers of 8 to 64 bits, 32- or 64-bit floats", name);
}

/// mm per unit of xyzt_units, with a note where that is not 1 for sure.
double unit_mm(const NiftiHeader& header, const std::string& name, std::vector<std::string>& notes) {
    switch (header.xyzt_units & 7) {
        case 0:
            notes.emplace_back("NIfTI: the header does not state its unit of length: millimetres assumed");
            return 1;
        case 1:
            notes.emplace_back("NIfTI: spacing and origin are in metres, and became millimetres");
            return 1000;
        case 2:
            return 1;
        case 3:
            notes.emplace_back("NIfTI: spacing and origin are in micrometres, and became millimetres");
            return 1e-3;
        default:
            throw bad_value("unit of xyzt_units", std::to_string(header.xyzt_units & 7),
                            "0 (unknown), 1 (metre), 2 (millimetre) or 3 (micrometre)", name);
    }
}

void check_finite(const Affine& affine, const char* what, const std::string& name) {
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 4; ++column) {
            if (std::isfinite(affine(row, column))) continue;
            throw bad_value(std::string(what) + "_" + "xyz"[row] + "[" + std::to_string(column) + "]",
                            std::isnan(affine(row, column)) ? "NaN" : "Inf", "finite", name);
        }
    }
}

/// nifti_quatern_to_mat44 of nifti1_io.c. NIfTI-1 rounds it to floats, as there, so that it goes with the sform.
Affine qform_of(const NiftiHeader& header) {
    double b = header.quaternion[0], c = header.quaternion[1], d = header.quaternion[2];
    const double length_2 = b * b + c * c + d * d;
    double a = 1 - length_2;
    if (a < 1e-7) {
        const double factor = 1 / std::sqrt(length_2);
        b *= factor, c *= factor, d *= factor, a = 0;
    } else {
        a = std::sqrt(a);
    }
    Affine affine;
    affine.leftCols<3>() << a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c),  //
        2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b),                      //
        2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - c * c - b * b;
    for (int axis = 0; axis < 3; ++axis) {
        affine.col(axis) *= header.pixdim[static_cast<std::size_t>(axis) + 1];
    }
    if (header.pixdim[0] < 0) affine.col(2) *= -1;  // qfac
    affine.col(3) = header.qoffset;
    return header.is_second ? affine : Affine(affine.cast<float>().cast<double>());
}

double length_of(const Eigen::Vector3d& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

/// The turn between the axes of two forms, "30.5 degrees".
std::string turn_text(const Affine& sform, const Affine& qform) {
    const Eigen::Matrix3d s = sform.leftCols<3>().colwise().normalized(),
                          q = qform.leftCols<3>().colwise().normalized();
    const double s_hand = determinant_of(s) < 0 ? -1 : 1, q_hand = determinant_of(q) < 0 ? -1 : 1;
    const Eigen::Matrix3d turn = nearest_rotation(s_hand * s) * nearest_rotation(q_hand * q).transpose();
    const double degrees = Eigen::AngleAxisd(turn).angle() * 180 / 3.14159265358979323846;
    return number_text(std::round(degrees * 100) / 100) + " degrees" +
           (s_hand == q_hand ? "" : ", and one of them is mirrored");
}

/// How far apart two forms put the same voxel, at most.
double farthest_mm_between(const Affine& a, const Affine& b, const NiftiHeader& header, double unit) {
    double farthest_mm = 0;
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector4d voxel(0, 0, 0, 1);
        for (int axis = 0; axis < 3; ++axis) {
            const auto i = static_cast<std::size_t>(axis);
            if ((corner >> axis & 1) != 0 && i < header.size.size()) voxel[axis] = header.size[i] - 1;
        }
        const double distance_mm = unit * ((a - b) * voxel).norm();
        if (!(distance_mm <= farthest_mm)) farthest_mm = distance_mm;
    }
    return farthest_mm;
}

/// The form that counts where both are set, with a note where they differ.
Affine form_of_two(const NiftiHeader& header, double unit, std::vector<std::string>& notes) {
    const Affine& sform = header.srow;
    const Affine qform = qform_of(header);
    const double farthest_mm = farthest_mm_between(sform, qform, header, unit);
    constexpr double kSame_mm = 0.05;  // floats and rounded quaternions are far nearer, other scans far off
    if (farthest_mm <= kSame_mm) {
        constexpr int kScannerAnatomy = 1;  // there the sform is what the scanner wrote; else the quaternion is
        return header.sform_code == kScannerAnatomy ? sform : qform;
    }
    std::string text = "NIfTI: the qform is not finite";
    if (std::isfinite(farthest_mm)) {
        text = "NIfTI: sform and qform disagree by up to " + number_text(std::round(farthest_mm * 100) / 100) +
               " mm and " + turn_text(sform, qform);
    }
    notes.push_back(text + ": the sform (code " + std::to_string(header.sform_code) + ") counts");
    return sform;
}

/// The voxel sides: pixdim, which is their number as written, unless the sform's columns say otherwise.
Eigen::Vector3d sides_of(const NiftiHeader& header, const Affine& affine, double unit,
                         std::vector<std::string>& notes) {
    constexpr double kRounding = 1e-5;  // of floats, and 5 micrometres over a volume
    Eigen::Vector3d sides, stated;
    for (int axis = 0; axis < 3; ++axis) {
        stated[axis] = sides[axis] = header.pixdim[static_cast<std::size_t>(axis) + 1];
        if (axis >= static_cast<int>(header.size.size())) continue;
        const double length = length_of(affine.col(axis));
        sides[axis] = std::abs(length - stated[axis]) <= kRounding * length ? stated[axis] : length;
    }
    if (sides != stated) {
        const auto text = [&](const Eigen::Vector3d& v) {
            return number_text(v[0] * unit) + " x " + number_text(v[1] * unit) + " x " + number_text(v[2] * unit);
        };
        notes.push_back("NIfTI: pixdim says voxels of " + text(stated) + " mm, the sform " + text(sides) +
                        " mm: the sform counts");
    }
    return sides * unit;
}

void check_pixdim(const NiftiHeader& header, const std::string& name) {
    for (std::size_t i = 0; i < std::min<std::size_t>(3, header.size.size()); ++i) {
        if (header.pixdim[i + 1] > 0 && std::isfinite(header.pixdim[i + 1])) continue;
        throw bad_value("voxel spacing along " + std::string(1, "xyz"[i]), number_text(header.pixdim[i + 1]),
                        "positive", name);
    }
}

/// Where the first three axes lie, in LPS and mm.
void take_place(const NiftiHeader& header, const std::string& name, Raster& raster) {
    const double unit = unit_mm(header, name, raster.notes);
    Affine affine = Affine::Identity();
    if (header.sform_code > 0) {
        check_finite(affine = header.srow, "srow", name);
        if (header.qform_code > 0) affine = form_of_two(header, unit, raster.notes);
    } else if (header.qform_code > 0) {
        check_finite(affine = qform_of(header), "qform", name);
    } else {
        affine.diagonal() << -header.pixdim[1], -header.pixdim[2], header.pixdim[3];
        raster.notes.emplace_back(
            "NIfTI: neither sform nor qform is set: voxel (0, 0, 0) is taken as the origin, the axes as those of LPS; "
            "where the volume lies, and whether it is mirrored, is unknown");
    }
    const Eigen::Vector3d sides_mm = sides_of(header, affine, unit, raster.notes);
    for (int axis = 0; axis < std::min<int>(3, static_cast<int>(raster.size.size())); ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        raster.spacing_mm[i] = sides_mm[axis];
        raster.origin_mm[i] = unit * (axis < 2 ? -affine(axis, 3) : affine(axis, 3));
        const double length = length_of(affine.col(axis));
        if (!(length > 0))
            throw bad_value("length of the sform's column " + std::to_string(axis), "0", "positive", name);
        for (int row = 0; row < std::min<int>(3, static_cast<int>(raster.size.size())); ++row) {
            raster.direction(row, axis) = (row < 2 ? -affine(row, axis) : affine(row, axis)) / length;
        }
    }
}

/// value = scl_slope * stored + scl_inter; a slope of 0 or NaN means that the stored values are the values.
void take_scaling(const NiftiHeader& header, const std::string& name, HeaderedRaster& file) {
    if (header.scl_slope == 0 || std::isnan(header.scl_slope) || file.raster.components != 1) return;
    for (const auto& [what, value] : {std::pair("scl_slope", header.scl_slope), {"scl_inter", header.scl_inter}}) {
        if (!std::isfinite(value)) throw bad_value(what, std::isnan(value) ? "NaN" : "Inf", "finite", name);
    }
    file.stored.slope = header.scl_slope;
    file.stored.intercept = header.scl_inter;
    if (file.stored.slope == 1 && file.stored.intercept == 0) return;
    file.raster.notes.push_back("NIfTI: values = stored * " + number_text(header.scl_slope) + " + " +
                                number_text(header.scl_inter));
}

}  // namespace

HeaderedRaster read_nifti(const std::filesystem::path& path) {
    const std::string name = path.string();
    const NiftiHeader header = read_nifti_header(path);
    check_pixdim(header, name);
    HeaderedRaster file;
    file.raster.format = FileFormat::nifti;
    std::tie(file.raster.type, file.raster.components) = nifti_type(header.datatype, name);
    set_size(file.raster, header.size);
    take_place(header, name, file.raster);
    take_scaling(header, name, file);
    file.raster.label_names = label_names_in_xml(header.extension);
    const bool is_named_gz = lower_case(header.voxel_file.string()).ends_with(".gz");
    const bool is_packed = is_named_gz || (header.is_single_file && is_gzip(header.voxel_file));
    file.stored.encoding = is_packed ? PixelEncoding::deflate : PixelEncoding::raw;
    file.stored.is_big_endian = header.is_big_endian;
    file.stored.parts = {{header.voxel_file, 0, static_cast<std::uint64_t>(header.vox_offset)}};
    return file;
}

}  // namespace raylign::detail
