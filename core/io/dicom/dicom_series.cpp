#include "core/io/dicom/dicom_series.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/base/error.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::uint32_t kStorageClass = 0x00020002, kSeriesDescription = 0x0008103e, kSeriesUid = 0x0020000e,
                        kSeriesNumber = 0x00200011, kPosition = 0x00200032, kOrientation = 0x00200037,
                        kPixelSpacing = 0x00280030;

DicomSlice slice_of(const DicomTags& tags, const std::string& file) {
    DicomSlice slice;
    slice.path = file;
    slice.size = {static_cast<int>(tags.number(kColumnsTag, 0)), static_cast<int>(tags.number(kRowsTag, 0))};
    const std::vector<double> position = tags.numbers(kPosition, 3);
    const std::vector<double> axes = tags.numbers(kOrientation, 6);
    const std::vector<double> pitch = tags.numbers(kPixelSpacing, 2);
    slice.has_place = !position.empty() && !axes.empty() && !pitch.empty();
    if (!slice.has_place) return slice;
    slice.position_mm = {position[0], position[1], position[2]};
    slice.axis_x = {axes[0], axes[1], axes[2]};  // direction in which the column index grows
    slice.axis_y = {axes[3], axes[4], axes[5]};
    slice.pitch_mm = {pitch[1], pitch[0]};  // DICOM gives row spacing (along y) first
    return slice;
}

/// CT Image Storage, Enhanced CT Image Storage, or a file cut off before it says what it is.
bool must_have_pixels(std::string_view storage_class) {
    return storage_class.empty() || storage_class == "1.2.840.10008.5.1.4.1.1.2" ||
           storage_class == "1.2.840.10008.5.1.4.1.1.2.1";
}

std::vector<std::string> files_in(const std::filesystem::path& folder) {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.is_regular_file()) files.push_back(entry.path().string());
    }
    std::ranges::sort(files);
    return files;
}

std::string list_of(const DicomFolder& found) {
    std::string list;
    for (std::size_t i = 0; i < found.series.size(); ++i) {
        const DicomSeries& series = found.series[i];
        list += "\n  " + std::to_string(i + 1) + ": " + (series.uid.empty() ? "(no UID)" : series.uid) + " \"" +
                series.description + "\", " + std::to_string(series.slices.size()) + " slices";
    }
    return list;
}

Eigen::Vector3d normal_of(const DicomSlice& slice) { return slice.axis_x.cross(slice.axis_y); }

void check_alike(const DicomSlice& slice, const DicomSlice& first) {
    constexpr double kTolerance = 1e-3;
    const std::string name = slice.path.string(), first_name = first.path.string();
    if (!slice.has_place) {
        throw Error(name +
                    " does not say where its slice lies (ImagePositionPatient, ImageOrientationPatient, PixelSpacing)");
    }
    if (slice.size != first.size) {
        throw bad_value("slice size", std::to_string(slice.size.x()) + " x " + std::to_string(slice.size.y()),
                        "like that of " + first_name + ", " + std::to_string(first.size.x()) + " x " +
                            std::to_string(first.size.y()),
                        name);
    }
    const double turned = std::max((slice.axis_x - first.axis_x).norm(), (slice.axis_y - first.axis_y).norm());
    if (!(turned < kTolerance))
        throw Error("orientation of " + name + " differs from that of " + first_name + ": must be one stack");
    if (!((slice.pitch_mm - first.pitch_mm).norm() < kTolerance)) {
        throw Error("pixel spacing of " + name + " differs from that of " + first_name + ": must be one stack");
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
        const std::string between = "between " + slices[i].path.string() + " and " + slices[i + 1].path.string();
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
                        "at most 0.1 mm and 2 % of the spacing", slices[i].path.string());
    }
    grid.spacing_mm.z() = step_mm.norm();
    grid.direction.col(2) = step_mm.normalized();
}

}  // namespace

DicomFolder scan_dicom_folder(const std::filesystem::path& folder) {
    const std::vector<std::string> files = files_in(folder);
    std::map<std::string, DicomSeries> by_uid;
    DicomFolder found;
    for (const std::string& file : files) {
        const std::optional<DicomTags> tags = read_dicom_tags(file);
        if (tags && !tags->has_pixels && must_have_pixels(tags->text(kStorageClass))) {
            throw Error(file + " is a DICOM image without pixels: damaged or truncated");
        }
        if (!tags || !tags->has_pixels) {
            ++found.ignored_files;  // other files, DICOMDIR, structure sets, reports
            continue;
        }
        const std::string uid = tags->text(kSeriesUid);
        DicomSeries& series = by_uid[uid];  // anonymisers empty the UID: such files make one series
        series.uid = uid;
        series.description = tags->text(kSeriesDescription);
        series.number = tags->number(kSeriesNumber, 0);
        series.slices.push_back(slice_of(*tags, file));
    }
    for (auto& [uid, series] : by_uid) found.series.push_back(std::move(series));
    std::ranges::stable_sort(found.series, {}, &DicomSeries::number);
    if (found.series.empty()) {
        throw Error(folder.string() + " has no DICOM image among its " + std::to_string(files.size()) +
                    " files: must be a file, or a folder with a DICOM series");
    }
    return found;
}

const DicomSeries& choose_series(const DicomFolder& found, const std::string& choice,
                                 const std::filesystem::path& folder) {
    if (choice.empty()) {
        if (found.series.size() == 1) return found.series.front();
        throw Error(folder.string() + " holds " + std::to_string(found.series.size()) +
                    " DICOM series: choose one with --series (its number or UID)" + list_of(found));
    }
    for (std::size_t i = 0; i < found.series.size(); ++i) {
        if (choice == found.series[i].uid || choice == std::to_string(i + 1)) return found.series[i];
    }
    throw bad_value("series", choice, "a number or UID of this list" + list_of(found), folder.string());
}

VoxelGrid stack_slices(DicomSeries& series) {
    const DicomSlice first = series.slices.front();
    for (const DicomSlice& slice : series.slices) check_alike(slice, first);
    const Eigen::Vector3d normal = normal_of(first);
    std::ranges::stable_sort(series.slices, {}, [&](const DicomSlice& slice) { return normal.dot(slice.position_mm); });
    VoxelGrid grid;
    grid.size = {first.size.x(), first.size.y(), static_cast<int>(series.slices.size())};
    // Not within Eigen's comma initialiser: its destructor asserts when an exception leaves it half filled.
    const double spacing_z_mm = checked_spacing_mm(series.slices, normal);
    grid.spacing_mm = {first.pitch_mm.x(), first.pitch_mm.y(), spacing_z_mm};
    grid.origin_mm = series.slices.front().position_mm;
    grid.direction << first.axis_x, first.axis_y, normal;
    follow_tilt(series.slices, normal, grid);
    return grid;
}

}  // namespace raylign::detail
