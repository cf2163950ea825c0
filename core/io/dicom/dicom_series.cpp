#include "core/io/dicom/dicom_series.h"

#include <algorithm>
#include <map>
#include <set>
#include <system_error>

#include "core/base/error.h"
#include "core/io/dicom/dicom_file.h"
#include "core/io/dicom/functional_groups.h"
#include "core/io/dicom/modality.h"
#include "core/io/dicom/tag_numbers.h"

namespace raylign::detail {
namespace {

void take_place(const DicomTags& tags, DicomSlice& slice) {
    const std::vector<double> position = tags.numbers(tag::kPosition, 3);
    const std::vector<double> axes = tags.numbers(tag::kOrientation, 6);
    const std::vector<double> pitch = tags.numbers(tag::kPixelSpacing, 2);
    slice.has_place = !position.empty() && !axes.empty() && !pitch.empty();
    if (!slice.has_place) return;
    slice.position_mm = {position[0], position[1], position[2]};
    slice.axis_x = {axes[0], axes[1], axes[2]};  // direction in which the column index grows
    slice.axis_y = {axes[3], axes[4], axes[5]};
    slice.pitch_mm = {pitch[1], pitch[0]};  // DICOM gives row spacing (along y) first
}

/// What tells stacks of one series apart; "" where the frames do not say.
std::string stack_of(const DicomTags& tags) {
    const std::string stack = tags.text(tag::kStackId), time = tags.text(tag::kTemporalPosition);
    return (stack.empty() ? "" : "stack " + stack) + (time.empty() ? "" : " time " + time);
}

class FolderScan {
public:
    void add(const std::string& path) {
        const std::optional<DicomFile> file = open(path);
        if (!file) return;
        const PixelLayout layout = pixel_layout(*file);
        const std::string why_no_ct = detail::why_no_ct(file->tags, path);
        for (int frame = 0; frame < layout.frames; ++frame) {
            const DicomTags tags = tags_of_frame(file->tags, frame, path);
            DicomSlice slice{path,      frame,
                             layout,    pixel_values(tags, layout, file->is_big_endian, path),
                             why_no_ct, tags.text(tag::kFrameOfReference)};
            take_place(tags, slice);
            add(tags, std::move(slice));
            if (!has_functional_groups(file->tags) && layout.frames > 1) break;  // no frame says where it lies
        }
    }

    DicomFolder take() {
        std::map<std::string, int> stacks;
        for (const auto& [key, series] : by_stack_) ++stacks[key.first];
        for (auto& [key, series] : by_stack_) {
            if (stacks[key.first] > 1) series.description += " " + key.second;
            found_.series.push_back(std::move(series));
        }
        std::ranges::stable_sort(found_.series, {}, &DicomSeries::number);
        return std::move(found_);
    }

private:
    /// Empty for a file that is no DICOM image, and for one to be left out.
    std::optional<DicomFile> open(const std::string& path) {
        if (!looks_like_dicom(path)) {
            std::error_code ignored;
            found_.empty_files += std::filesystem::file_size(path, ignored) == 0;
            ++found_.ignored_files;
            return std::nullopt;
        }
        DicomFile file = open_dicom(path);
        if (!file.tags.has_pixels && must_have_pixels(file.tags)) {
            throw Error(path + " is a DICOM image without pixels: damaged or truncated");
        }
        if (!file.tags.has_pixels) {
            ++found_.ignored_files;  // DICOMDIR, structure sets, reports
            return std::nullopt;
        }
        if (is_localizer(file.tags)) {
            ++found_.localizers;
            return std::nullopt;
        }
        return file;
    }

    void add(const DicomTags& tags, DicomSlice slice) {
        const std::string uid = tags.text(tag::kSeriesUid);
        DicomSeries& series = by_stack_[{uid, stack_of(tags)}];  // anonymisers empty the UID: one series
        series.uid = uid;
        series.description = tags.text(tag::kSeriesDescription);
        series.number = tags.number(tag::kSeriesNumber, 0);
        series.slices.push_back(std::move(slice));
    }

    DicomFolder found_;
    std::map<std::pair<std::string, std::string>, DicomSeries> by_stack_;  // by UID and stack
};

std::vector<std::string> names_in(const std::filesystem::path& folder, std::filesystem::file_type type) {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        std::error_code ignored;
        if (entry.status(ignored).type() == type) names.push_back(entry.path().string());
    }
    std::ranges::sort(names);
    return names;
}

/// ": these folders within it have DICOM files: ..."; "" where there are none.
std::string folders_with_dicom(const std::filesystem::path& folder) {
    std::string list;
    for (const std::string& inner : names_in(folder, std::filesystem::file_type::directory)) {
        const std::vector<std::string> files = names_in(inner, std::filesystem::file_type::regular);
        const auto count = std::ranges::count_if(files, [](const std::string& file) { return looks_like_dicom(file); });
        if (count > 0) list += "\n  " + inner + ": " + std::to_string(count) + " DICOM files";
    }
    return list.empty() ? list : ". These folders within it have some; give one of them" + list;
}

std::string list_of(const DicomFolder& found) {
    std::string list;
    for (std::size_t i = 0; i < found.series.size(); ++i) {
        const DicomSeries& series = found.series[i];
        list += "\n  " + std::to_string(i + 1) + ": " + (series.uid.empty() ? "(no UID)" : series.uid) + " \"" +
                series.description + "\", " + series.file_text() + (series.is_ct() ? "" : ", no CT");
    }
    return list;
}

}  // namespace

bool DicomSeries::is_ct() const {
    return std::ranges::any_of(slices, [](const DicomSlice& slice) { return slice.why_no_ct.empty(); });
}

std::string DicomSeries::file_text() const {
    std::set<std::filesystem::path> files;
    for (const DicomSlice& slice : slices) files.insert(slice.path);
    if (files.size() == slices.size()) return std::to_string(files.size()) + " slices";
    return std::to_string(slices.size()) + " frames of " + std::to_string(files.size()) +
           (files.size() == 1 ? " file" : " files");
}

DicomFolder scan_dicom(const std::filesystem::path& path) {
    const bool is_folder = std::filesystem::is_directory(path);
    const std::vector<std::string> files =
        is_folder ? names_in(path, std::filesystem::file_type::regular) : std::vector<std::string>{path.string()};
    FolderScan scan;
    for (const std::string& file : files) scan.add(file);
    DicomFolder found = scan.take();
    found.path = path;
    if (!found.series.empty()) return found;
    if (found.localizers > 0) {
        throw Error(path.string() + " has nothing but localizers (ImageType (0008,0008)): must be the slices of a CT");
    }
    if (!is_folder) throw Error(path.string() + " is no DICOM image");
    throw Error(path.string() + " has no DICOM image among its " + std::to_string(files.size()) +
                " files: must be a file, or a folder with a DICOM series" + folders_with_dicom(path));
}

const DicomSeries& choose_series(const DicomFolder& found, const std::string& choice) {
    std::vector<const DicomSeries*> fitting;
    for (std::size_t i = 0; i < found.series.size(); ++i) {
        const DicomSeries& series = found.series[i];
        if (choice.empty() ? series.is_ct() : choice == series.uid || choice == std::to_string(i + 1)) {
            fitting.push_back(&series);
        }
    }
    if (fitting.size() == 1) return *fitting.front();
    if (choice.empty() && found.series.size() == 1) return found.series.front();
    if (choice.empty() || fitting.size() > 1) {
        throw Error(found.path.string() + " holds " + std::to_string(found.series.size()) +
                    " DICOM series: choose one with --series (its number or UID)" + list_of(found));
    }
    throw bad_value("series", choice, "a number or UID of this list" + list_of(found), found.path.string());
}

std::vector<std::string> folder_notes(const DicomFolder& found, const DicomSeries& series) {
    std::vector<std::string> notes;
    notes.push_back("DICOM series " + series.uid + " \"" + series.description + "\", " + series.file_text());
    if (found.ignored_files > 0) {
        notes.push_back(std::to_string(found.ignored_files) +
                        " files of the folder are no DICOM images and were ignored" +
                        (found.empty_files > 0 ? " (" + std::to_string(found.empty_files) + " empty)" : ""));
    }
    if (found.localizers > 0) {
        notes.push_back(std::to_string(found.localizers) + " localizers of the folder were left out");
    }
    if (found.series.size() > 1) {
        notes.push_back(std::to_string(found.series.size() - 1) + " other series of the folder were left out");
    }
    return notes;
}

}  // namespace raylign::detail
