#include "raylign/io/pose.h"

#include "core/io/files/one_eigen.h"

#include <itkHDF5TransformIO.h>
#include <itkMatrixOffsetTransformBase.h>
#include <itkTransformFileReader.h>
#include <itkTranslationTransform.h>
#include <itkTxtTransformIO.h>

#include "core/base/error.h"
#include "core/io/decode/small_files.h"
#include "core/io/files/file_format.h"
#include "core/io/files/json_node.h"
#include "core/io/files/output.h"
#include "core/io/files/text.h"
#include "core/io/images/quiet_itk.h"
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

using MatrixTransform = itk::MatrixOffsetTransformBase<double, 3, 3>;
using Translation = itk::TranslationTransform<double, 3>;

RigidTransform pose_from_itk_transform(const itk::TransformBaseTemplate<double>& transform, const std::string& where) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (const auto* shift = dynamic_cast<const Translation*>(&transform)) {
        for (unsigned r = 0; r < 3; ++r) matrix(r, 3) = shift->GetOffset()[r];
        return rigid_from_matrix(matrix, where);
    }
    const auto* affine = dynamic_cast<const MatrixTransform*>(&transform);
    if (affine == nullptr) {
        throw bad_value("transform type", transform.GetTransformTypeAsString(),
                        "a rigid one in 3-D: Euler3D, VersorRigid3D, Affine, Translation", where);
    }
    for (unsigned r = 0; r < 3; ++r) {
        for (unsigned c = 0; c < 3; ++c) matrix(r, c) = affine->GetMatrix()(r, c);
        matrix(r, 3) = affine->GetOffset()[r];
    }
    return rigid_from_matrix(matrix, where);
}

/// What the file holds: ct_from_world.
RigidTransform pose_from_itk(const std::filesystem::path& path, itk::TransformIOBaseTemplate<double>& io) {
    const detail::QuietItk quiet;
    const auto reader = itk::TransformFileReaderTemplate<double>::New();
    reader->SetFileName(path.string());
    reader->SetTransformIO(&io);
    try {
        reader->Update();
    } catch (const itk::ExceptionObject& failure) {
        throw Error(path.string() + " is not a readable ITK transform: " + detail::reason_of(failure));
    } catch (const std::exception& failure) {
        throw Error(path.string() + " is not a readable ITK transform: " + failure.what());
    }
    const auto* transforms = reader->GetTransformList();
    if (transforms->size() != 1) {
        throw bad_value("number of transforms", std::to_string(transforms->size()), "1", path.string());
    }
    return pose_from_itk_transform(*transforms->front(), path.string());
}

RigidTransform pose_from_itk_text(const std::filesystem::path& path) {
    return inverse(pose_from_itk(path, *itk::TxtTransformIOTemplate<double>::New()));
}

RigidTransform pose_from_itk_hdf5(const std::filesystem::path& path) {
    return inverse(pose_from_itk(path, *itk::HDF5TransformIOTemplate<double>::New()));
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
    const Eigen::Matrix4d matrix = to_matrix(world_from_ct);
    nlohmann::json rows = nlohmann::json::array();
    for (int r = 0; r < 4; ++r) rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
    return detail::json_text({{"raylign", 1}, {"world_from_ct", rows}});
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

RigidTransform read_pose(const std::filesystem::path& path) {
    detail::check_readable_file(path);
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension == ".json") return pose_from_json(path);
    if (extension == ".tfm" || extension == ".txt") return pose_in_own_process(path, &pose_from_itk_text);
    if (extension == ".h5" || extension == ".hdf5") return pose_in_own_process(path, &pose_from_itk_hdf5);
    if (extension == ".jts" || extension == ".jtak" || extension == ".jta") return only_pose(path);
    throw bad_value("format of the pose", extension, ".json, .tfm, .txt, .h5, .hdf5, .jts, .jtak or .jta",
                    path.string());
}

void write_pose(const std::filesystem::path& path, const RigidTransform& world_from_ct) {
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension != ".json" && extension != ".tfm" && extension != ".txt") {
        throw bad_value("format of the pose", extension, ".json, .tfm or .txt", path.string());
    }
    write_text(path, extension == ".json" ? json_text_of(world_from_ct) : itk_text(inverse(world_from_ct)));
}

}  // namespace raylign
