#include "core/io/datasets/imported_case.h"

#include <algorithm>
#include <cstring>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/io/datasets/hdf5_file.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"
#include "raylign/io/pose.h"

namespace raylign::detail {
namespace {

using nlohmann::json;

std::string point_text(const auto& point) {
    std::string text;
    for (Eigen::Index i = 0; i < point.size(); ++i) text += "," + number_text(point[i]);
    return text + "\n";
}

json view_json(const ImportedView& view, bool has_mask) {
    const Camera& camera = view.geometry.geometry.camera;
    json intensity = {{"kind", view.is_transmission ? "transmission" : "line-integral"},
                      {"polarity", view.is_transmission ? "bone-dark" : "bone-bright"}};
    if (view.i0) intensity["i0"] = *view.i0;
    json result = {{"name", view.name},
                   {"image", view.name + ".tif"},
                   {"intensity", intensity},
                   {"size_px", {camera.size_px.x(), camera.size_px.y()}},
                   {"intrinsics", rows_of(camera.intrinsics_px)},
                   {"camera_from_world", rows_of(to_matrix(view.geometry.geometry.camera_from_world))}};
    if (camera.sdd_mm) result["sdd_mm"] = *camera.sdd_mm;
    if (has_mask) result["mask"] = "mask.tif";
    if (view.geometry.flip != ImageFlip::none) {
        result["flip"] = view.geometry.flip == ImageFlip::columns ? "columns" : "rows";
    }
    return result;
}

/// 0 within `border_px` of the rim, 255 elsewhere.
Raster border_mask(const Eigen::Vector2i& size_px, int border_px) {
    Raster mask;
    mask.format = FileFormat::tiff;
    mask.size = {size_px.x(), size_px.y()};
    mask.spacing_mm = {1, 1};
    mask.origin_mm = {0, 0};
    mask.direction = Eigen::MatrixXd::Identity(2, 2);
    mask.type = PixelType::u8;
    for (int y = 0; y < size_px.y(); ++y) {
        for (int x = 0; x < size_px.x(); ++x) {
            const int rim = std::min({x, y, size_px.x() - 1 - x, size_px.y() - 1 - y});
            mask.bytes.push_back(std::byte(rim < border_px ? 0 : 255));
        }
    }
    return mask;
}

/// Stages files and remembers their names.
struct CaseWriter {
    OutputFolder& folder;
    std::vector<std::string> names;

    void raster(const std::string& name, const Raster& raster) { write_raster(staged(name), raster); }
    void text(const std::string& name, const std::string& text) { write_text(staged(name), text); }
    [[nodiscard]] std::filesystem::path staged(const std::string& name) {
        names.push_back(name);
        return folder.stage(name);
    }
};

void write_object(const ImportedCase& imported, CaseWriter& writer) {
    writer.raster("ct.mha", imported.volume);
    if (imported.labels) writer.raster("labels.mha", *imported.labels);
    if (!imported.label_names.empty()) {
        std::string text = "label,name\n";
        for (const auto& [number, name] : imported.label_names) text += number + "," + name + "\n";
        writer.text("labels.csv", text);
    }
    if (imported.landmarks.empty()) return;
    std::string text;
    json targets = json::array();
    for (const Landmark& landmark : imported.landmarks) {
        text += landmark.name + point_text(landmark.x_ct_mm);
        targets.push_back({landmark.x_ct_mm.x(), landmark.x_ct_mm.y(), landmark.x_ct_mm.z()});
    }
    writer.text("landmarks.csv", text);
    writer.text("targets.json", json_text({{"raylign", 1}, {"targets_ct_mm", targets}}));
}

/// What the page at the end says of a view.
struct WrittenView {
    std::string name;
    std::vector<std::string> bones;
    std::size_t points = 0;
    std::vector<std::string> remarks;
};

WrittenView write_view(const ImportedCase& imported, const std::string& name, CaseWriter& writer, json& list) {
    const ImportedView view = imported.read_view(name);
    const Eigen::Vector2i size_px = view.geometry.geometry.camera.size_px;
    if (imported.border_px > 0 && list.empty()) {
        if (2 * imported.border_px >= size_px.minCoeff()) {
            throw bad_value("border", std::to_string(imported.border_px) + " px",
                            "less than half of the X-rays' smaller side, " + std::to_string(size_px.minCoeff()));
        }
        writer.raster("mask.tif", border_mask(size_px, imported.border_px));
    }
    writer.raster(name + ".tif", view.image);
    WrittenView written{name, {}, view.points.size(), view.remarks};
    if (!view.points.empty()) {
        std::string text;
        for (const ImagePoint& point : view.points) text += point.name + point_text(point.pixel);
        writer.text("points_" + name + ".csv", text);
    }
    for (const ImportedPose& pose : view.poses) {
        write_pose(writer.staged("pose_" + name + "_" + pose.bone + ".json"), pose.world_from_ct);
        written.bones.push_back(pose.bone);
    }
    list.push_back(view_json(view, imported.border_px > 0));
    if (imported.views.size() > 1) {
        writer.text("views_" + name + ".json", json_text({{"raylign", 1}, {"views", json::array({list.back()})}}));
    }
    return written;
}

/// The labels that belong to a bone: those whose names contain its name.
std::string labels_of_bone(const ImportedCase& imported, const std::string& bone) {
    std::vector<std::string> numbers;
    for (const auto& [number, name] : imported.label_names) {
        if (name.find(bone) != std::string::npos) numbers.push_back(number);
    }
    if (!imported.labels || numbers.empty()) return "";
    std::string flags = " --labels labels.mha";
    for (const std::string& number : numbers) flags += " --label " + number;
    return flags;
}

std::string commands_text(const ImportedCase& imported, const WrittenView& view) {
    const std::string views = imported.views.size() > 1 ? "views_" + view.name + ".json" : "views.json";
    std::string text;
    for (const std::string& bone : view.bones) {
        const std::string pose = "pose_" + view.name + "_" + bone + ".json";
        const bool is_of_landmarks = bone == view.bones.front();
        const std::string targets = is_of_landmarks && !imported.landmarks.empty() ? " --targets targets.json" : "";
        const std::string object = "-v ct.mha" + imported.volume_flags + labels_of_bone(imported, bone);
        text += "    raylign study " + object + " --views " + views + " --truth " + pose + targets + " -o study_" +
                view.name + "_" + bone + "\n";
        constexpr std::size_t kFewest = 4;  // that give one view a start
        const std::string start =
            is_of_landmarks && view.points >= kFewest
                ? " --landmarks3d landmarks.csv --landmarks " + view.name + "=points_" + view.name + ".csv"
                : " --start " + pose + " --search near";
        text += "    raylign register " + object + " --views " + views + start + " --truth " + pose + targets + " -o " +
                view.name + "_" + bone + "\n";
    }
    return text;
}

/// Of the landmarks' bone, which lies still: in all views at once.
std::string all_views_text(const ImportedCase& imported, const WrittenView& first) {
    if (imported.views.size() < 2 || first.bones.empty()) return "";
    const std::string& bone = first.bones.front();
    const std::string targets = imported.landmarks.empty() ? "" : " --targets targets.json";
    return "    raylign study -v ct.mha" + imported.volume_flags + labels_of_bone(imported, bone) +
           " --views views.json --truth pose_" + first.name + "_" + bone + ".json" + targets + " -o study_all_" + bone +
           "\n";
}

std::string case_readme(const ImportedCase& imported, const std::vector<WrittenView>& views) {
    std::string text = "# " + imported.title + "\n\nWritten by `raylign import`.\n\n## Files\n\n";
    text +=
        "- `ct.mha`: the volume. `VIEW.tif`: an X-ray, pixels as stored. `views.json`: all views in one world; "
        "`views_VIEW.json`: each alone, where there are several.\n"
        "- `pose_VIEW_BONE.json`: the data set's reference pose, world_from_ct.\n";
    if (imported.labels) text += "- `labels.mha`, `labels.csv`: segmentation of the volume and the labels' names.\n";
    if (!imported.landmarks.empty()) {
        text +=
            "- `landmarks.csv`, `targets.json`: points of the volume [mm], for --landmarks3d and --targets. "
            "`points_VIEW.csv`: where they lie on the stored image [px].\n";
    }
    if (imported.border_px > 0) {
        text += "- `mask.tif`: leaves out " + std::to_string(imported.border_px) + " px at the rim.\n";
    }
    text += "\n## Conventions\n\n";
    for (const std::string& convention : imported.conventions) text += "- " + convention + "\n";
    text += "\n## Views\n\n| view | landmarks on it | reference poses | remarks |\n|---|---|---|---|\n";
    for (const WrittenView& view : views) {
        text += "| " + view.name + " | " + std::to_string(view.points) + " | " + joined(view.bones) + " | " +
                joined(view.remarks, "; ") + " |\n";
    }
    text += "\n## To go on, in this folder\n\n";
    return text + commands_text(imported, views.front()) + all_views_text(imported, views.front());
}

bool is_number(const std::string& text) {
    return !text.empty() && text.size() < 10 && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::vector<std::string> case_file_names(const ImportedCase& imported) {
    std::vector<std::string> names{"ct.mha",       "labels.mha", "labels.csv", "landmarks.csv",
                                   "targets.json", "views.json", "mask.tif",   "README.md"};
    for (const std::string& view : imported.views) {
        for (const std::string& name : {view + ".tif", "points_" + view + ".csv", "views_" + view + ".json"}) {
            names.push_back(name);
        }
    }
    return names;
}

std::vector<std::string> write_case(const ImportedCase& imported, OutputFolder& folder) {
    CaseWriter writer{folder, {}};
    write_object(imported, writer);
    json list = json::array();
    std::vector<WrittenView> views;
    for (const std::string& name : imported.views) views.push_back(write_view(imported, name, writer, list));
    writer.text("views.json", json_text({{"raylign", 1}, {"views", list}}));
    writer.text("README.md", case_readme(imported, views));
    return writer.names;
}

Raster raster_of(const Hdf5Array& array, const std::vector<int>& size, FileFormat format) {
    Raster raster;
    raster.format = format;
    raster.size = size;
    const auto dimensions = static_cast<Eigen::Index>(size.size());
    raster.spacing_mm.assign(size.size(), 1.0);
    raster.origin_mm.assign(size.size(), 0.0);
    raster.direction = Eigen::MatrixXd::Identity(dimensions, dimensions);
    raster.type = array.type;
    raster.bytes = array.bytes;
    const bool is_common = array.type == PixelType::u8 || array.type == PixelType::u16 ||
                           array.type == PixelType::f32 || (format == FileFormat::meta && bytes_of(array.type) < 8);
    if (is_common) return raster;
    std::vector<float> pixels(raster.pixel_count());
    with_pixels(raster, [&](const auto* stored) {
        for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<float>(stored[i]);
    });
    raster.type = PixelType::f32;
    raster.bytes.resize(pixels.size() * sizeof(float));
    std::memcpy(raster.bytes.data(), pixels.data(), raster.bytes.size());
    return raster;
}

std::vector<std::string> chosen_views(const std::vector<std::string>& wanted, const std::vector<std::string>& views,
                                      const std::string& where) {
    if (wanted.empty()) return views;
    std::vector<std::string> chosen;
    for (const std::string& name : wanted) {
        const auto fits = [&](const std::string& view) {
            return view == name || (is_number(view) && is_number(name) && std::stoi(view) == std::stoi(name));
        };
        const auto found = std::ranges::find_if(views, fits);
        if (found == views.end()) throw bad_value("--view", name, "one of " + joined(views), where);
        if (std::ranges::find(chosen, *found) != chosen.end()) throw Error("--view names " + *found + " twice");
        chosen.push_back(*found);
    }
    return chosen;
}

}  // namespace raylign::detail
