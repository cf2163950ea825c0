#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/io/datasets/imported_case.h"

namespace raylign::detail {

/// What is taken out of a file of a public data set.
struct DatasetOptions {
    std::string case_name;           ///< specimen or patient; "" = the only one
    std::vector<std::string> views;  ///< names or numbers; none = all
    std::optional<int> border_px;    ///< DeepFluoro: masked at the rim; default: 50 of 1536, as its loaders crop
    std::optional<double> i0;        ///< DeepFluoro: open beam; default 65487, as its loaders have it
};

/// DeepFluoro's full-resolution file (rg2/DeepFluoroLabeling-IPCAI2020): proj-params, SPECIMEN/vol, vol-seg,
/// vol-landmarks, projections. Its cameras have the source in the origin, x along columns, y along rows, z from the
/// detector to the source; pixel = K extrinsic (cam-to-BONE-vol)^-1 x_ct / z with integer pixel centres. The world is
/// the camera world frame of the first view taken; those of the others are brought there by the pelvis. rot-180-for-up
/// is about display and is left alone. Throws Error naming what is missing or of another form. Source:
/// hdf5_layouts/Readme.md and examples_dataset there.
[[nodiscard]] ImportedCase read_deepfluoro(const std::filesystem::path& path, const DatasetOptions& options);

/// The Ljubljana cerebral angiograms as DiffDRR and xvr have them (ljubljana.h5): subjectNN/volume, points, proj-ap,
/// proj-lat, proj-ap-max, proj-lat-max. pixel = K extrinsic x / z as in DeepFluoro, x in the volume's own frame [mm],
/// which is the world: the reference pose is the identity. The volume is stored with x slowest and reversed. X-rays
/// become log(max + 1) - log(pixel + 1), as the loaders have it. Without views: ap and lat.
/// Source: DiffPose's and DiffDRR-Datasets' ljubljana.py.
[[nodiscard]] ImportedCase read_ljubljana(const std::filesystem::path& path, const DatasetOptions& options);

/// The view of a projection of stored pixels whose depth may have either sign: that of `x_ct_mm` is made positive.
/// Mirrored images are reversed on reading, their columns.
[[nodiscard]] GeometryView dataset_view(const Eigen::Matrix<double, 3, 4>& pixel_from_ct,
                                        const RigidTransform& ct_from_world, const Eigen::Vector3d& x_ct_mm,
                                        const Eigen::Vector2i& size_px, double sdd_mm, const std::string& where);

/// K with finite entries and a last row 0 0 1; the mean of |K00| column_mm and |K11| row_mm is the distance to the
/// detector.
struct DatasetIntrinsics {
    Eigen::Matrix3d matrix_px = Eigen::Matrix3d::Identity();
    double sdd_mm = 0;
};
class Hdf5File;
[[nodiscard]] DatasetIntrinsics read_intrinsics(const Hdf5File& file, const std::string& name, double column_mm,
                                                double row_mm);

/// The group that the user names, or the only one. `choices`: all there are.
[[nodiscard]] std::string chosen_case(const std::string& wanted, const std::vector<std::string>& choices,
                                      const std::string& option, const std::string& where);

/// Pixel sides and voxel sides.
[[nodiscard]] double positive_mm(double value_mm, const std::string& place);

}  // namespace raylign::detail
