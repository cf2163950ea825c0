#include "raylign/io/pose.h"

#include "core/base/error.h"
#include "core/io/decode/small_files.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/files/file_format.h"
#include "core/io/files/json_node.h"
#include "core/io/files/output.h"
#include "core/io/files/text.h"
#include "core/io/poses/itk_transform.h"
#include "core/io/poses/spatial_registration.h"
#include "raylign/io/trajectory.h"

namespace raylign {
using namespace detail;
namespace {

RigidTransform pose_from_json(const std::filesystem::path& path) {
    const nlohmann::json json = detail::read_json(path);
    const detail::JsonNode root(json, "the file", path.string());
    root.allow_keys({"raylign", "world_from_ct"});
    detail::check_format_version(root);
    const detail::JsonNode matrix = root.at("world_from_ct");
    return rigid_from_matrix(matrix.matrix<4, 4>(), matrix.where());
}

RigidTransform pose_from_hdf5(const std::filesystem::path& path) {
    return inverse(detail::rigid_from_transforms(detail::read_hdf5_transforms(path), path.string()));
}

std::string itk_text(const RigidTransform& ct_from_world) {
    std::string text = "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\nParameters:";
    const auto append = [&](double number) { (text += ' ') += detail::number_text(number); };
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) append(ct_from_world.rotation(r, c));
    }
    for (int r = 0; r < 3; ++r) append(ct_from_world.translation_mm[r]);
    return text + "\nFixedParameters: 0 0 0\n";
}

std::string json_text_of(const RigidTransform& world_from_ct) {
    return detail::json_text({{"raylign", 1}, {"world_from_ct", detail::rows_of(to_matrix(world_from_ct))}});
}

/// Of a table of poses with one row.
RigidTransform only_pose(const std::filesystem::path& path) {
    const PoseSequence sequence = read_jointtrack_poses(path);
    if (sequence.frames.size() == 1 && sequence.frames.front().world_from_ct) {
        return *sequence.frames.front().world_from_ct;
    }
    throw bad_value("poses", std::to_string(sequence.frames.size()),
                    "1 here: take one out by raylign poses " + path.filename().string() + " --frame N -o pose.json",
                    path.string());
}

}  // namespace

RigidTransform read_pose(const std::filesystem::path& path, const std::filesystem::path& ct) {
    detail::check_readable_file(path);
    const bool is_ct_dicom = !ct.empty() && detail::looks_like_dicom(ct);
    if (detail::looks_like_dicom(path)) return detail::read_spatial_registration(path, is_ct_dicom ? ct : "");
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension == ".json") return pose_from_json(path);
    if (extension == ".tfm" || extension == ".txt") {
        return inverse(detail::rigid_from_transforms(detail::read_text_transforms(path), path.string()));
    }
    if (extension == ".h5" || extension == ".hdf5") return pose_in_own_process(path, &pose_from_hdf5);
    if (extension == ".jts" || extension == ".jtak" || extension == ".jta") return only_pose(path);
    throw bad_value("format of the pose", extension, ".json, .tfm, .txt, .h5, .hdf5, .dcm, .jts, .jtak or .jta",
                    path.string());
}

void write_pose(const std::filesystem::path& path, const RigidTransform& world_from_ct,
                const std::filesystem::path& ct) {
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension == ".dcm") {
        if (ct.empty()) throw Error(path.string() + ": a DICOM pose needs the DICOM CT that it belongs to");
        write_text(path, detail::spatial_registration(world_from_ct, ct));
        return;
    }
    if (extension != ".json" && extension != ".tfm" && extension != ".txt") {
        throw bad_value("format of the pose", extension, ".json, .tfm, .txt or .dcm", path.string());
    }
    write_text(path, extension == ".json" ? json_text_of(world_from_ct) : itk_text(inverse(world_from_ct)));
}

}  // namespace raylign
