#include "raylign/io/volume.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/io/dicom/dicom_series.h"
#include "core/io/dicom/dicom_stack.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"
#include "core/io/images/raster.h"
#include "core/io/volumes/label_map.h"
#include "core/io/volumes/mesh_volume.h"
#include "core/io/volumes/object_region.h"
#include "core/io/volumes/square_grid.h"
#include "core/io/volumes/volume_grid.h"
#include "raylign/intensity.h"

namespace raylign {
using namespace detail;
namespace {

using detail::number_text;
using detail::Raster;

/// Whole numbers as they are, others with six significant digits: what single precision leaves behind
/// (789.0000610351562) tells nobody anything.
std::string voxel_text(double value) {
    constexpr int kDigits = 6;
    if (value == std::trunc(value)) return number_text(value);
    std::array<char, 32> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, kDigits);
    return {text.data(), end.ptr};
}

/// Turns the file's numbers into 1/mm and remembers what it met.
class Converter {
public:
    Converter(const VolumeReadOptions& options, VoxelGrid grid)
        : options_(options),
          preset_(options.hu_preset.empty() ? hu_presets().front() : hu_preset(options.hu_preset)),
          grid_(std::move(grid)) {
        voxels_.reserve(static_cast<std::size_t>(grid_.voxel_count()));
    }

    /// Appends the pixels of `raster`, one plane or all, in the file's order.
    void append(const Raster& raster, const std::filesystem::path& path) {
        detail::with_pixels(raster, [&](const auto* pixels) {
            for (std::size_t i = 0; i < raster.pixel_count(); ++i) {
                append(static_cast<double>(pixels[i]), path);
            }
        });
    }
    /// Appends one plane of several; padding is air.
    void append_plane(const Raster& raster, int plane, const std::filesystem::path& path) {
        const auto count = static_cast<std::size_t>(raster.size[0]) * static_cast<std::size_t>(raster.size[1]);
        const std::size_t first = count * static_cast<std::size_t>(plane);
        detail::with_pixels(raster, [&](const auto* pixels) {
            for (std::size_t i = first; i < first + count; ++i) {
                if (!raster.is_padding.empty() && raster.is_padding[i]) {
                    ++padding_;
                    voxels_.push_back(0);
                } else {
                    append(static_cast<double>(pixels[i]), path);
                }
            }
        });
    }

    [[nodiscard]] Volume take() { return {grid_, std::move(voxels_)}; }
    /// Throws where the numbers met are in the other unit. DICOM states its unit by its rescale slope and intercept.
    void check_unit(detail::FileFormat format, const std::filesystem::path& path) const;
    void describe(detail::PixelType type, std::vector<std::string>& notes) const;

private:
    void append(double value, const std::filesystem::path& path) {
        constexpr double kLargest = std::numeric_limits<float>::max();
        if (!(std::abs(value) <= kLargest)) throw_not_a_float(value, path);
        lowest_ = std::min(lowest_, value);
        highest_ = std::max(highest_, value);
        if (options_.is_attenuation) {
            voxels_.push_back(static_cast<float>(value));
            return;
        }
        const double hu = value + options_.hu_offset;
        air_ += hu <= preset_.cutoff_hu;
        voxels_.push_back(attenuation_from_hu(hu, preset_));
    }

    [[noreturn]] void throw_not_a_float(double value, const std::filesystem::path& path) const {
        const std::size_t i = voxels_.size();
        const auto nx = static_cast<std::size_t>(grid_.size.x()), ny = static_cast<std::size_t>(grid_.size.y());
        throw bad_value("voxel (" + std::to_string(i % nx) + ", " + std::to_string(i / nx % ny) + ", " +
                            std::to_string(i / nx / ny) + ")",
                        std::isnan(value)   ? "NaN"
                        : std::isinf(value) ? "Inf"
                                            : voxel_text(value),
                        "finite, and not above what a float can hold", path.string());
    }

    const VolumeReadOptions& options_;
    const HuPreset& preset_;
    VoxelGrid grid_;
    std::vector<float> voxels_;
    double lowest_ = std::numeric_limits<double>::infinity(), highest_ = -lowest_;
    std::size_t air_ = 0, padding_ = 0;
};

void Converter::check_unit(detail::FileFormat format, const std::filesystem::path& path) const {
    constexpr double kLeastHu = 10;                // HU of a CT go from -1000 to beyond this
    constexpr double kLowest = -1, kHighest = 10;  // 1/mm: lead at 60 keV has 5.7
    const std::string range = path.string() + ": voxels go from " + voxel_text(lowest_) + " to " + voxel_text(highest_);
    if (options_.is_attenuation) {
        if (lowest_ >= kLowest && highest_ <= kHighest) return;
        throw Error(range +
                    ", which look like HU: linear attenuation must be in [-1, 10] per mm; leave out --attenuation");
    }
    if (format != detail::FileFormat::dicom && lowest_ >= -kLeastHu && highest_ <= kLeastHu) {
        throw Error(range + ", too narrow a range for HU: voxels in 1/mm need --attenuation");
    }
}

void Converter::describe(detail::PixelType type, std::vector<std::string>& notes) const {
    if (padding_ > 0) {
        notes.push_back(std::to_string(padding_) + " voxels have PixelPaddingValue (0028,0120) and became air");
    }
    const std::string range = voxel_text(lowest_) + " to " + voxel_text(highest_);
    if (options_.is_attenuation) {
        notes.push_back("voxels (" + range + ") are taken as linear attenuation in 1/mm");
        return;
    }
    if (options_.hu_offset != 0) notes.push_back("HU = stored value + " + number_text(options_.hu_offset));
    notes.push_back("HU (stored " + range + ", " + detail::pixel_type_name(type) + ") became 1/mm by preset " +
                    std::string(preset_.name) + ": " + number_text(preset_.water_per_mm) + " * (1 + HU / 1000), " +
                    std::to_string(air_) + " voxels at or below " + number_text(preset_.cutoff_hu) + " HU became 0");
    if (lowest_ + options_.hu_offset > -500) {
        notes.push_back(
            "no voxel is as thin as air (-1000 HU): if the file holds HU plus an offset, such as 1024, air will "
            "attenuate here");
    }
}

void check_volume(const Raster& raster, const std::filesystem::path& path) {
    const std::string size = detail::size_text(raster.size);
    if (raster.components != 1) {
        throw bad_value("numbers per voxel", std::to_string(raster.components), "1 (a scalar volume)", path.string());
    }
    if (raster.size.size() < 3) throw bad_value("size", size, "3-D (this is a 2-D image)", path.string());
    for (std::size_t axis = 3; axis < raster.size.size(); ++axis) {
        if (raster.size[axis] > 1) throw bad_value("size", size, "3-D, one time point", path.string());
    }
}

/// May be sheared still: see square_grid.h.
VoxelGrid grid_of(const Raster& raster, const VolumeReadOptions& options, const std::filesystem::path& path,
                  std::vector<std::string>& notes) {
    if (!raster.no_place.empty()) throw Error(path.string() + " does not say where its voxels lie: " + raster.no_place);
    VoxelGrid grid;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        grid.size[axis] = raster.size[i];
        grid.spacing_mm[axis] = raster.spacing_mm[i];
        grid.origin_mm[axis] = raster.origin_mm[i];
    }
    grid.direction = raster.direction.topLeftCorner<3, 3>();
    if (raster.format == detail::FileFormat::tiff) {
        if (!options.spacing_mm)
            throw Error(path.string() + ": a TIFF does not say its voxel size: give --spacing X,Y,Z (mm)");
        constexpr double kLargest = 1000;
        for (const double spacing : *options.spacing_mm) {
            if (spacing > 0 && spacing <= kLargest) continue;
            throw bad_value("--spacing", number_text(spacing) + " mm", "in (0, 1000] mm", path.string());
        }
        grid.spacing_mm = *options.spacing_mm;
    } else if (options.spacing_mm) {
        throw Error(path.string() + " states its own spacing: --spacing must be left out (it is for TIFF)");
    }
    check_and_square(grid, path.string(), notes);
    return grid;
}

void note_mirror(const VoxelGrid& grid, std::vector<std::string>& notes) {
    if (determinant_of(grid.direction) < 0)
        notes.emplace_back("the voxel axes are left-handed (direction matrix of determinant -1)");
}

VolumeFile read_file(const std::filesystem::path& path, const VolumeReadOptions& options) {
    Raster raster = detail::read_raster(path, [&](const Raster& header) {
        check_volume(header, path);
        std::vector<std::string> ignored;
        (void)grid_of(header, options, path, ignored);  // before the voxels are read
    });
    VolumeFile file;
    file.notes = raster.notes;
    Converter converter(options, grid_of(raster, options, path, file.notes));
    converter.append(raster, path);
    converter.check_unit(raster.format, path);
    converter.describe(raster.type, file.notes);
    if (raster.format == detail::FileFormat::tiff) {
        file.notes.emplace_back("TIFF: voxel (0, 0, 0) is the origin, columns, rows and pages are the x, y and z axes");
    }
    file.volume = converter.take();
    on_square_grid(file.volume, file.notes);
    note_mirror(file.volume.grid, file.notes);
    file.files.push_back(path);
    return file;
}

/// Reads the slices in their order; a file of many frames once.
detail::PixelType append_slices(const detail::DicomSeries& series, Converter& converter, VolumeFile& file) {
    Raster raster;
    std::filesystem::path at;
    for (const detail::DicomSlice& slice : series.slices) {
        if (at != slice.path) {
            at = slice.path;
            raster = detail::read_raster(slice.path);
            if (file.files.empty()) file.notes.insert(file.notes.end(), raster.notes.begin(), raster.notes.end());
            if (std::ranges::find(file.files, slice.path) == file.files.end()) file.files.push_back(slice.path);
        }
        converter.append_plane(raster, slice.frame, slice.path);
    }
    return raster.type;
}

bool is_dicom_volume(const std::filesystem::path& path) {
    return std::filesystem::is_directory(path) || detail::format_of(path) == detail::FileFormat::dicom;
}

VolumeFile read_dicom_volume(const std::filesystem::path& path, const VolumeReadOptions& options) {
    const detail::DicomFolder found = detail::scan_dicom(path);
    detail::DicomSeries series = detail::choose_series(found, options.series);
    if (options.spacing_mm)
        throw Error(path.string() + " states its own spacing: --spacing must be left out (it is for TIFF)");
    VolumeFile file;
    file.notes = detail::folder_notes(found, series);
    const std::vector<std::string> value_notes = detail::check_values(series);
    file.notes.insert(file.notes.end(), value_notes.begin(), value_notes.end());
    VoxelGrid grid = detail::stack_slices(series);
    check_and_square(grid, path.string(), file.notes);
    Converter converter(options, grid);
    const detail::PixelType type = append_slices(series, converter, file);
    converter.check_unit(detail::FileFormat::dicom, path);
    converter.describe(type, file.notes);
    file.volume = converter.take();
    on_square_grid(file.volume, file.notes);
    return file;
}

}  // namespace

VolumeFile read_volume(const std::filesystem::path& path, const VolumeReadOptions& options) {
    if (!options.hu_preset.empty()) (void)hu_preset(options.hu_preset);  // a wrong name is an error in any case
    if (!std::filesystem::is_directory(path)) detail::check_readable_file(path);
    if (!is_dicom_volume(path) && !options.series.empty()) {
        throw Error(path.string() + " is no DICOM: --series chooses within a DICOM folder or file");
    }
    if (!is_model_file(path) && !options.material.empty()) {
        throw Error(path.string() + " is no model (STL, OBJ, PLY): --material must be left out");
    }
    VolumeFile file = is_model_file(path)     ? read_model(path, options)
                      : is_dicom_volume(path) ? read_dicom_volume(path, options)
                                              : read_file(path, options);
    file.file_grid = file.volume.grid;
    if (!options.object.is_whole()) {
        file.volume.surface.reset();
        detail::keep_object(options, file);
    }
    return file;
}

bool is_model(const std::filesystem::path& path) { return is_model_file(path); }

Eigen::Vector3d model_centre_mm(const std::filesystem::path& path, const VolumeReadOptions& options) {
    const MeshBounds bounds = model_bounds(path, options);
    return (bounds.low_mm + bounds.high_mm) / 2;
}

VoxelGrid detail::read_volume_grid(const std::filesystem::path& path, const VolumeReadOptions& options) {
    VoxelGrid grid;
    if (is_dicom_volume(path)) {
        detail::DicomSeries series = detail::choose_series(detail::scan_dicom(path), options.series);
        grid = detail::stack_slices(series);
        std::vector<std::string> ignored;
        check_and_square(grid, path.string(), ignored);
        return square_grid(grid);
    }
    (void)read_raster(path, [&](const Raster& header) {
        check_volume(header, path);
        std::vector<std::string> ignored;
        grid = square_grid(grid_of(header, options, path, ignored));
    });
    return grid;
}

LabelMap read_label_map(const std::filesystem::path& path, const VoxelGrid& like) {
    return detail::read_label_map_file(path, like).map;
}

namespace detail {

LabelMapFile read_label_map_file(const std::filesystem::path& path, const VoxelGrid& like) {
    VolumeReadOptions options;
    check_readable_file(path);
    Raster raster = is_dicom_volume(path)
                        ? read_dicom_stack(path)
                        : read_raster(path, [&](const Raster& header) { check_volume(header, path); });
    if (raster.format == FileFormat::tiff) {
        options.spacing_mm = like.spacing_mm;
        if (Eigen::Vector3i(raster.size[0], raster.size[1], raster.size[2]) != like.size) {
            throw bad_value("size of the labels", size_text(raster.size),
                            "the CT's (a TIFF does not say where its voxels lie)", path.string());
        }
    }
    LabelMapFile file{.map = {}, .names = raster.label_names, .notes = raster.notes};
    LabelMap& map = file.map;
    map.grid = raster.format == FileFormat::tiff ? like : grid_of(raster, options, path, file.notes);
    map.labels.reserve(raster.pixel_count());
    with_pixels(raster, [&](const auto* pixels) {
        for (std::size_t i = 0; i < raster.pixel_count(); ++i) {
            const auto value = static_cast<double>(pixels[i]);
            if (!(std::abs(value) < 2147483648.0) || value != std::round(value)) {
                throw bad_value("label", number_text(value), "a whole number", path.string());
            }
            map.labels.push_back(static_cast<std::int32_t>(value));
        }
    });
    on_square_grid(map, file.notes);
    return file;
}

}  // namespace detail
}  // namespace raylign
