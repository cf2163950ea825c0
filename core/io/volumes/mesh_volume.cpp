#include "core/io/volumes/mesh_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/io/files/json_node.h"
#include "core/io/files/text.h"
#include "core/io/meshes/material.h"
#include "core/io/meshes/mesh_file.h"
#include "core/io/meshes/thinned_mesh.h"
#include "core/io/meshes/voxelize_mesh.h"

namespace raylign::detail {
namespace {

// Bones and implants are 10 mm (a screw's length, a carpal bone) to half a metre.
constexpr double kSmall_mm = 10, kTiny_mm = 1, kLarge_mm = 1000, kHuge_mm = 3000;
constexpr double kMostVoxels = 4e8;       // 1.6 GB
constexpr double kChosenVoxels = 6.4e7;   // 256 MB: what is chosen unasked
constexpr double kVoxelsAlong = 256;      // where nothing else says how fine
constexpr double kThinned_voxels = 0.05;  // a thirtieth of a pixel, where voxels are two thirds of one

struct Part {
    std::filesystem::path file;
    std::string material, unit;
    SolidMesh solid;
};

constexpr std::array<std::pair<std::string_view, double>, 4> kUnits{{{"mm", 1}, {"cm", 10}, {"m", 1000}, {"in", 25.4}}};

double unit_mm(const std::string& unit) {
    for (const auto& [name, mm] : kUnits) {
        if (unit == name) return mm;
    }
    throw bad_value("unit of a mesh", unit, "mm, cm, m or in");
}

/// What the part would be in other units: "32 mm if it is in m".
std::string in_other_units(double side_mm, const std::string& stated) {
    const double raw = side_mm / unit_mm(stated);
    std::string text;
    for (const auto& [name, mm] : kUnits) {
        const double other = raw * mm;
        if (name == stated || other < kSmall_mm || other > kLarge_mm) continue;
        text += (text.empty() ? "" : ", ") + fixed(other, 0) + " mm if it is in " + std::string(name);
    }
    return text.empty() ? "" : " (" + text + ")";
}

/// A file of triangles has no unit: sizes that no part has are refused, unlikely ones are named.
void check_size(double side_mm, const Part& part, std::vector<std::string>& notes) {
    if (side_mm >= kSmall_mm && side_mm <= kLarge_mm) return;
    const std::string stated = part.unit.empty() ? "mm" : part.unit;
    const std::string found = part.file.string() + " is " + number_text(std::round(side_mm * 1000) / 1000) +
                              " mm across" + (part.unit.empty() ? "" : " in " + stated) +
                              in_other_units(side_mm, stated);
    if (side_mm < kTiny_mm || side_mm > kHuge_mm) {
        throw Error(found + ": that is no size of a bone or an implant; say its unit by --mesh-unit mm|cm|m|in");
    }
    if (part.unit.empty()) {
        notes.push_back(found + ": suspicious for a bone or an implant; --mesh-unit says the unit");
    } else {
        notes.push_back(found + ": suspicious for a bone or an implant; is that its unit?");
    }
}

std::vector<Part> list_parts(const std::filesystem::path& path, const VolumeReadOptions& options) {
    if (is_mesh_file(path)) return {{path, options.material, options.mesh_unit, {}}};
    const nlohmann::json json = read_json(path);
    const JsonNode root(json, "the file", path.string());
    root.allow_keys({"raylign", "parts"});
    check_format_version(root);
    const JsonNode list = root.at("parts");
    std::vector<Part> parts;
    for (std::size_t i = 0; i < list.array_size(); ++i) {
        const JsonNode node = list.at(i);
        node.allow_keys({"mesh", "material", "unit"});
        Part part{path.parent_path() / node.at("mesh").string(), options.material, options.mesh_unit, {}};
        if (!is_mesh_file(part.file)) throw node.at("mesh").error("an STL, OBJ or PLY file");
        if (node.has("material")) part.material = node.at("material").string();
        if (node.has("unit")) part.unit = node.at("unit").string();
        parts.push_back(std::move(part));
    }
    if (parts.empty()) throw list.error("at least one part");
    return parts;
}

void read_part(Part& part, std::vector<std::string>& notes) {
    TriangleMesh mesh = read_mesh(part.file);
    const double mm = part.unit.empty() ? 1 : unit_mm(part.unit);
    for (Eigen::Vector3d& v : mesh.vertices_mm) v *= mm;
    part.solid = solid_of(std::move(mesh), part.file.string());
    check_size(bounds_of(part.solid.mesh).largest_side_mm(), part, notes);
    for (const std::string& note : part.solid.notes) notes.push_back(part.file.string() + ": " + note);
}

std::vector<Part> read_parts(const std::filesystem::path& path, const VolumeReadOptions& options,
                             std::vector<std::string>& notes) {
    std::vector<Part> parts = list_parts(path, options);
    for (Part& part : parts) read_part(part, notes);
    return parts;
}

MeshBounds bounds_of(const std::vector<Part>& parts) {
    MeshBounds all = detail::bounds_of(parts.front().solid.mesh);
    for (const Part& part : parts) {
        const MeshBounds one = detail::bounds_of(part.solid.mesh);
        all.low_mm = all.low_mm.cwiseMin(one.low_mm);
        all.high_mm = all.high_mm.cwiseMax(one.high_mm);
    }
    return all;
}

void check_options(const std::filesystem::path& path, const VolumeReadOptions& options) {
    if (options.is_attenuation || options.hu_offset != 0) {
        throw Error(path.string() + " is a model and has no voxels: --attenuation and --hu-offset must be left out");
    }
    if (options.spacing_mm)
        throw Error(path.string() + " is a model: its voxels' size is --mesh-spacing, not --spacing");
    if (!options.series.empty()) throw Error(path.string() + " is no DICOM: --series must be left out");
    if (options.mesh_spacing_mm && !(*options.mesh_spacing_mm > 0 && *options.mesh_spacing_mm <= 10)) {
        throw bad_value("--mesh-spacing", number_text(*options.mesh_spacing_mm) + " mm", "in (0, 10] mm");
    }
}

/// As asked for; else as proposed, or so that the longest side has 256 voxels, coarser where that would be too many.
VoxelGrid grid_for(const MeshBounds& bounds, const VolumeReadOptions& options, std::vector<std::string>& notes) {
    if (options.mesh_spacing_mm) return grid_around(bounds, *options.mesh_spacing_mm, kMostVoxels);
    double spacing_mm = options.proposed_mesh_spacing_mm.value_or(bounds.largest_side_mm() / kVoxelsAlong);
    const double voxels = ((bounds.high_mm - bounds.low_mm).array() / spacing_mm + 3).prod();
    if (voxels > kChosenVoxels) spacing_mm *= std::cbrt(voxels / kChosenVoxels);
    spacing_mm = std::round(spacing_mm * 1000) / 1000 + (spacing_mm < 5e-4 ? spacing_mm : 0);
    notes.push_back("voxels of " + number_text(spacing_mm) + " mm for the model, " +
                    (options.proposed_mesh_spacing_mm && voxels <= kChosenVoxels
                         ? "two thirds of a pixel of the views there"
                         : "256 along it at most") +
                    "; --mesh-spacing chooses others");
    return grid_around(bounds, spacing_mm, kMostVoxels);
}

/// True where the surface alone says how much each ray meets: nothing of the part counts twice.
bool add_part(const Part& part, double per_mm, std::vector<float>& taken, Volume& volume,
              std::vector<std::string>& notes) {
    const MeshFill fill = voxelize_mesh(part.solid.mesh, volume.grid);
    double shared_voxels = 0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
        const float share = std::min(fill.share[i], 1 - taken[i]);
        shared_voxels += static_cast<double>(fill.share[i]) - static_cast<double>(share);
        taken[i] += share;
        volume.attenuation_per_mm[i] += share * static_cast<float>(per_mm);
    }
    const double most_mm3 = 1e-3 * part.solid.volume_mm3, shared_mm3 = shared_voxels * volume.grid.spacing_mm.prod();
    if (fill.crossing_mm3 > most_mm3) {
        notes.push_back(part.file.string() + ": its surface crosses itself or lies in itself: " +
                        fixed(fill.crossing_mm3, 1) + " mm3 of " + fixed(part.solid.volume_mm3, 1) + " count once");
    }
    if (shared_mm3 > most_mm3) {
        notes.push_back(part.file.string() + ": " + fixed(shared_mm3, 1) +
                        " mm3 of it lie in parts before it, which have them");
    }
    return fill.crossing_mm3 <= most_mm3 && shared_mm3 <= most_mm3;
}

void add_surface(const Part& part, double per_mm, double voxel_mm, Surface& surface) {
    const auto first = static_cast<std::int32_t>(surface.vertices_mm.size());
    const TriangleMesh mesh = thinned(part.solid.mesh, kThinned_voxels * voxel_mm);
    surface.vertices_mm.insert(surface.vertices_mm.end(), mesh.vertices_mm.begin(), mesh.vertices_mm.end());
    for (const TriangleMesh::Triangle& t : mesh.triangles) {
        surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    surface.attenuation_per_mm.resize(surface.triangles.size(), static_cast<float>(per_mm));
}

}  // namespace

bool is_model_file(const std::filesystem::path& path) {
    return is_mesh_file(path) || lower_case(path.extension().string()) == ".json";
}

MeshBounds model_bounds(const std::filesystem::path& path, const VolumeReadOptions& options) {
    std::vector<std::string> ignored;
    return bounds_of(read_parts(path, options, ignored));
}

VolumeFile read_model(const std::filesystem::path& path, const VolumeReadOptions& options) {
    check_options(path, options);
    const HuPreset& preset = options.hu_preset.empty() ? hu_presets().front() : hu_preset(options.hu_preset);
    VolumeFile file;
    file.files.push_back(path);
    std::vector<double> per_mm;
    for (const Part& part : list_parts(path, options)) {  // a wrong name should not wait for a large mesh
        if (part.material.empty()) {
            throw Error(part.file.string() +
                        ": what is it made of? Give --material cobalt-chrome, titanium, steel, "
                        "polyethylene, bone, HU=N or MU=N");
        }
        per_mm.push_back(attenuation_of_material(part.material, preset));
        if (part.file != path) file.files.push_back(part.file);
    }
    const std::vector<Part> parts = read_parts(path, options, file.notes);
    Volume& volume = file.volume;
    volume.grid = grid_for(bounds_of(parts), options, file.notes);
    volume.attenuation_per_mm.resize(static_cast<std::size_t>(volume.grid.voxel_count()));
    std::vector<float> taken(volume.attenuation_per_mm.size());
    Surface surface;
    bool is_exact = options.keeps_surface;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        file.notes.push_back(parts[i].file.string() + ": " + std::to_string(parts[i].solid.mesh.triangles.size()) +
                             " triangles around " + fixed(parts[i].solid.volume_mm3 / 1000, 2) + " cm3 of " +
                             parts[i].material + ", " + fixed(per_mm[i], 4) + " per mm");
        if (!add_part(parts[i], per_mm[i], taken, volume, file.notes)) is_exact = false;
        add_surface(parts[i], per_mm[i], volume.grid.spacing_mm.x(), surface);
    }
    if (is_exact) {
        file.notes.push_back("DRRs are made from " + std::to_string(surface.triangles.size()) +
                             " triangles of the model");
        volume.surface = std::make_shared<const Surface>(std::move(surface));
    }
    if (options.keeps_surface && !is_exact) file.notes.push_back(path.string() + ": DRRs are made from its voxels");
    return file;
}

}  // namespace raylign::detail
