#include "core/io/dicom/dicom_stack.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

Eigen::Vector3d normal_of(const DicomSlice& slice) { return slice.axis_x.cross(slice.axis_y); }

std::string name_of(const DicomSlice& slice) {
    const std::string name = slice.path.string();
    return slice.layout.frames > 1 ? "frame " + std::to_string(slice.frame + 1) + " of " + name : name;
}

/// Voxels 1000 columns from the first one must not be off by more than a tenth of a millimetre.
constexpr double kPitchTolerance_mm = 1e-4, kAxisTolerance = 1e-3;

void check_alike(const DicomSlice& slice, const DicomSlice& first) {
    const std::string name = name_of(slice), first_name = name_of(first);
    if (!slice.has_place) {
        throw Error(name +
                    " does not say where its slice lies (ImagePositionPatient, ImageOrientationPatient, PixelSpacing)");
    }
    check_same_layout(slice.layout, first.layout, name, first_name);
    const double turned = std::max((slice.axis_x - first.axis_x).norm(), (slice.axis_y - first.axis_y).norm());
    if (!(turned < kAxisTolerance))
        throw Error("orientation of " + name + " differs from that of " + first_name + ": must be one stack");
    if (!((slice.pitch_mm - first.pitch_mm).norm() < kPitchTolerance_mm)) {
        throw bad_value("PixelSpacing (0028,0030)",
                        number_text(slice.pitch_mm.y()) + " x " + number_text(slice.pitch_mm.x()) + " mm",
                        "like that of " + first_name + ", " + number_text(first.pitch_mm.y()) + " x " +
                            number_text(first.pitch_mm.x()) + " mm",
                        name);
    }
    if (slice.frame_of_reference != first.frame_of_reference) {
        throw bad_value("FrameOfReferenceUID (0020,0052)", slice.frame_of_reference,
                        "like that of " + first_name + ", " + first.frame_of_reference, name);
    }
}

/// Even steps between neighbours are the spacing; anything else means a missing, doubled or foreign slice.
double checked_spacing_mm(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& normal) {
    std::vector<double> gaps_mm;
    for (std::size_t i = 1; i < slices.size(); ++i) {
        gaps_mm.push_back(normal.dot(slices[i].position_mm - slices[i - 1].position_mm));
    }
    std::vector<double> sorted = gaps_mm;
    std::ranges::sort(sorted);
    const double usual_mm = sorted[sorted.size() / 2];
    // Positions are rounded to 0.001 to 0.01 mm in many files.
    const double tolerance_mm = std::max(0.01, 0.02 * usual_mm);
    for (std::size_t i = 0; i < gaps_mm.size(); ++i) {
        if (gaps_mm[i] > 1e-3 && std::abs(gaps_mm[i] - usual_mm) <= tolerance_mm) continue;
        const std::string between = "between " + name_of(slices[i]) + " and " + name_of(slices[i + 1]);
        if (gaps_mm[i] <= 1e-3) throw Error("two slices at the same place: " + between.substr(8));
        const double missing = std::round(gaps_mm[i] / usual_mm) - 1;
        const std::string guess = missing >= 1 ? " (" + number_text(missing) + " missing)" : "";
        throw bad_value("slice gap", number_text(gaps_mm[i]) + " mm" + guess,
                        "even, " + number_text(usual_mm) + " mm as elsewhere in the series", between);
    }
    const auto steps = static_cast<double>(gaps_mm.size());
    return normal.dot(slices.back().position_mm - slices.front().position_mm) / steps;
}

/// Where the slices lie askew on their way (a tilted gantry), the third axis goes from slice to slice: square_grid.h
/// resamples such a grid.
void follow_tilt(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& normal, VoxelGrid& grid) {
    constexpr double kLeastCosine = 0.99999;  // 0.26 degrees
    const Eigen::Vector3d first_mm = slices.front().position_mm;
    const Eigen::Vector3d step_mm = (slices.back().position_mm - first_mm) / static_cast<double>(slices.size() - 1);
    if (step_mm.normalized().dot(normal) >= kLeastCosine) return;
    for (std::size_t i = 0; i < slices.size(); ++i) {
        constexpr double kTolerance_mm = 0.1;  // of places rounded to 0.01 mm; a bent stack is no lattice
        const double off_mm = (slices[i].position_mm - first_mm - static_cast<double>(i) * step_mm).norm();
        if (off_mm <= kTolerance_mm + 0.02 * step_mm.norm()) continue;
        throw bad_value("distance of a slice from the line of the others", number_text(off_mm) + " mm",
                        "at most 0.1 mm and 2 % of the spacing", name_of(slices[i]));
    }
    grid.spacing_mm.z() = step_mm.norm();
    grid.direction.col(2) = step_mm.normalized();
}

std::string rescale_text(const PixelValues& values) {
    return values.is_stated ? number_text(values.slope) + " and " + number_text(values.intercept) : "missing";
}

void check_slice_count(const DicomSeries& series) {
    const DicomSlice& only = series.slices.front();
    if (series.slices.size() > 1) return;
    if (only.layout.frames > 1) {
        throw Error(only.path.string() + " has " + std::to_string(only.layout.frames) +
                    " frames and does not say where each lies (Per-frame Functional Groups (5200,9230) are missing)");
    }
    throw bad_value("size",
                    std::to_string(only.layout.size.x()) + " x " + std::to_string(only.layout.size.y()) + " x 1",
                    "3-D (this is one slice; for a series give its folder, " + only.path.parent_path().string() + ")",
                    only.path.string());
}

}  // namespace

VoxelGrid stack_slices(DicomSeries& series) {
    check_slice_count(series);
    const DicomSlice first = series.slices.front();
    for (const DicomSlice& slice : series.slices) check_alike(slice, first);
    const Eigen::Vector3d normal = normal_of(first);
    std::ranges::stable_sort(series.slices, {}, [&](const DicomSlice& slice) { return normal.dot(slice.position_mm); });
    VoxelGrid grid;
    grid.size = {first.layout.size.x(), first.layout.size.y(), static_cast<int>(series.slices.size())};
    // Not within Eigen's comma initialiser: its destructor asserts when an exception leaves it half filled.
    const double spacing_z_mm = checked_spacing_mm(series.slices, normal);
    grid.spacing_mm = {first.pitch_mm.x(), first.pitch_mm.y(), spacing_z_mm};
    grid.origin_mm = series.slices.front().position_mm;
    grid.direction << first.axis_x, first.axis_y, normal;
    follow_tilt(series.slices, normal, grid);
    return grid;
}

std::vector<std::string> check_values(const DicomSeries& series) {
    constexpr std::array<std::string_view, 4> kHu = {"", "HU", "HU_MOD", "US"};  // US: not specified
    const DicomSlice& first = series.slices.front();
    bool differs = false;
    for (const DicomSlice& slice : series.slices) {
        if (!slice.why_no_ct.empty()) throw Error(slice.why_no_ct);
        const PixelValues &values = slice.values, &others = first.values;
        if (values.is_stated != others.is_stated) {
            throw bad_value(
                "RescaleSlope and RescaleIntercept", rescale_text(values),
                "there in all slices or in none; in " + name_of(first) + " they are " + rescale_text(others),
                name_of(slice));
        }
        if (std::ranges::find(kHu, values.unit) == kHu.end() || values.unit != others.unit) {
            throw bad_value("RescaleType (0028,1054)", values.unit,
                            "HU, and alike in all slices (other values are no attenuation)", name_of(slice));
        }
        differs = differs || values.slope != others.slope || values.intercept != others.intercept;
    }
    std::vector<std::string> notes;
    if (!first.values.is_stated && !first.values.lut) {
        notes.emplace_back("RescaleSlope and RescaleIntercept are missing: stored values are taken as HU");
    }
    if (first.values.unit == "US") notes.emplace_back("RescaleType (0028,1054) is US (unspecified): taken as HU");
    if (differs) notes.emplace_back("each slice has its own RescaleSlope and RescaleIntercept");
    return notes;
}

Raster read_dicom_stack(const std::filesystem::path& path) {
    DicomSeries series = choose_series(scan_dicom(path), "");
    VoxelGrid grid = stack_slices(series);
    const Raster stored = read_raster(path);
    Raster sorted = stored;
    const std::size_t plane = stored.bytes.size() / static_cast<std::size_t>(stored.size[2]);
    for (std::size_t i = 0; i < series.slices.size(); ++i) {
        const auto from = static_cast<std::ptrdiff_t>(plane * static_cast<std::size_t>(series.slices[i].frame));
        std::copy_n(stored.bytes.begin() + from, plane, sorted.bytes.begin() + static_cast<std::ptrdiff_t>(plane * i));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        sorted.spacing_mm[axis] = grid.spacing_mm[static_cast<int>(axis)];
        sorted.origin_mm[axis] = grid.origin_mm[static_cast<int>(axis)];
    }
    sorted.direction = grid.direction;
    return sorted;
}

}  // namespace raylign::detail
