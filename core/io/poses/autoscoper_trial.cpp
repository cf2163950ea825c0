#include "core/io/poses/autoscoper_trial.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/number_text_reader.h"

namespace raylign::detail {
namespace {

/// "KEY value" in two.
struct TrialEntry {
    int line = 0;
    std::string key, value;
};

std::vector<TrialEntry> trial_entries(const std::filesystem::path& path) {
    std::vector<TrialEntry> entries;
    for (const TextLine& line : text_lines(path)) {
        if (line.text.starts_with('#')) continue;
        const std::size_t blank = line.text.find_first_of(" \t");
        TrialEntry entry{line.number, line.text.substr(0, blank), ""};
        if (blank != std::string::npos) entry.value = trimmed(std::string_view(line.text).substr(blank));
        entries.push_back(std::move(entry));
    }
    return entries;
}

std::string entry_place(const std::filesystem::path& path, const TrialEntry& entry) {
    return path.string() + ", line " + std::to_string(entry.line);
}

std::filesystem::path trial_path(const std::filesystem::path& trial, const TrialEntry& entry, bool is_relative) {
    if (entry.value.empty()) throw bad_value(entry.key, "\"\"", "a name", entry_place(trial, entry));
    std::string name = entry.value;
    std::ranges::replace(name, '\\', '/');
    while (name.size() > 1 && name.ends_with('/')) name.pop_back();
    std::error_code ignored;
    const std::filesystem::path beside = trial.parent_path() / name;
    if (is_relative || std::filesystem::exists(beside, ignored)) return beside;
    return std::filesystem::exists(name, ignored) ? std::filesystem::path(name) : beside;
}

Eigen::Vector3d trial_triple(const std::filesystem::path& path, const TrialEntry& entry) {
    const std::vector<double> numbers = line_numbers({entry.line, entry.value}, 3, entry.key, path);
    return {numbers[0], numbers[1], numbers[2]};
}

void add_volume_entry(const std::filesystem::path& path, const TrialEntry& entry, std::vector<Eigen::Vector3d>& sizes,
                      std::vector<Eigen::Vector3d>& flips) {
    const Eigen::Vector3d triple = trial_triple(path, entry);
    if (entry.key == "VolumeFlip") {
        flips.push_back(triple);
        return;
    }
    constexpr double kLargest = 1000;
    if (!(triple.minCoeff() > 0) || !(triple.maxCoeff() <= kLargest)) {
        throw bad_value("VoxelSize", entry.value, "three numbers in (0, 1000] mm", entry_place(path, entry));
    }
    sizes.push_back(triple);
}

/// Version 1.1 and later: paths are relative to the trial.
bool has_relative_paths(const std::vector<TrialEntry>& entries) {
    const auto version = std::ranges::find(entries, "Version", &TrialEntry::key);
    return version != entries.end() && number_from(version->value).value_or(0) >= 1.1;
}

void check_counts(const AutoscoperTrial& trial, std::size_t folders, std::size_t sizes, const std::string& where) {
    if (trial.cameras.empty()) throw Error(where + " names no camera: at least one mayaCam_csv is needed");
    if (trial.cameras.size() != folders) {
        throw bad_value("CameraRootDir", std::to_string(folders) + " lines",
                        "as many as mayaCam_csv, " + std::to_string(trial.cameras.size()), where);
    }
    if (trial.volumes.size() != sizes) {
        throw bad_value("VoxelSize", std::to_string(sizes) + " lines",
                        "as many as VolumeFile, " + std::to_string(trial.volumes.size()), where);
    }
}

}  // namespace

AutoscoperTrial read_autoscoper_trial(const std::filesystem::path& path) {
    const std::vector<TrialEntry> entries = trial_entries(path);
    const bool is_relative = has_relative_paths(entries);
    AutoscoperTrial trial;
    std::vector<std::filesystem::path> folders;
    std::vector<Eigen::Vector3d> sizes, flips;
    for (const TrialEntry& entry : entries) {
        if (entry.key == "mayaCam_csv") {
            trial.cameras.push_back({trial_path(path, entry, is_relative), {}});
        } else if (entry.key == "CameraRootDir") {
            folders.push_back(trial_path(path, entry, is_relative));
        } else if (entry.key == "VolumeFile") {
            trial.volumes.push_back({.file = trial_path(path, entry, is_relative)});
        } else if (entry.key == "VolumeFlip" || entry.key == "VoxelSize") {
            add_volume_entry(path, entry, sizes, flips);
        } else {
            constexpr std::array<std::string_view, 10> kKeys = {
                "mayaCam_csv",      "CameraRootDir",       "VolumeFile", "VolumeFlip",     "VoxelSize",
                "RenderResolution", "OptimizationOffsets", "Version",    "TrackingFolder", "FilterFolder"};
            if (std::ranges::find(kKeys, entry.key) != kKeys.end()) continue;
            throw bad_value("key of the trial", "\"" + entry.key.substr(0, 40) + "\"", "one of " + joined(kKeys, ", "),
                            entry_place(path, entry));
        }
    }
    check_counts(trial, folders.size(), sizes.size(), path.string());
    for (std::size_t i = 0; i < folders.size(); ++i) trial.cameras[i].frames = folders[i];
    for (std::size_t i = 0; i < trial.volumes.size(); ++i) {
        trial.volumes[i].voxel_mm = sizes[i];
        for (int axis = 0; axis < 3 && i < flips.size(); ++axis) {
            trial.volumes[i].flips[static_cast<std::size_t>(axis)] = flips[i][axis] != 0;
        }
    }
    return trial;
}

bool is_autoscoper_trial(const std::filesystem::path& path) {
    return lower_case(path.extension().string()) == ".cfg" && geometry_format_of(path) == GeometryFormat::autoscoper;
}

VoxelGrid flipped_grid(const VoxelGrid& part, const VoxelGrid& whole, const std::array<bool, 3>& flips) {
    Eigen::Matrix3d mirror = Eigen::Matrix3d::Identity();  // in voxel axes
    for (int axis = 0; axis < 3; ++axis) mirror(axis, axis) = flips[static_cast<std::size_t>(axis)] ? -1 : 1;
    const Eigen::Matrix3d ct_from_ct = whole.direction * mirror * whole.direction.transpose();
    VoxelGrid grid = part;
    grid.direction = ct_from_ct * part.direction;
    grid.origin_mm = whole.centre_ct_mm() + ct_from_ct * (part.origin_mm - whole.centre_ct_mm());
    return grid;
}

std::vector<GeometryView> read_autoscoper_cameras(const std::filesystem::path& path, const GeometryHints& hints) {
    std::vector<GeometryView> views;
    for (const TrialCamera& camera : read_autoscoper_trial(path).cameras) {
        for (GeometryView& view : read_geometry(camera.mayacam, hints)) views.push_back(std::move(view));
    }
    return views;
}

}  // namespace raylign::detail
