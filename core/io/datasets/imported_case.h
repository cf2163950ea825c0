#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/io/files/output.h"
#include "core/io/images/raster.h"
#include "raylign/io/geometry.h"
#include "raylign/io/landmarks.h"
#include "raylign/rigid_transform.h"

namespace raylign::detail {

/// The reference pose of a bone.
struct ImportedPose {
    std::string bone;
    RigidTransform world_from_ct;
};

/// One X-ray of a public data set.
struct ImportedView {
    std::string name;
    GeometryView geometry;
    Raster image;                     ///< as stored, before any flip
    bool is_transmission = false;     ///< else line integrals
    std::optional<double> i0;         ///< of a transmission image
    std::vector<ImagePoint> points;   ///< the landmarks that lie on it, as stored
    std::vector<ImportedPose> poses;  ///< the first one is that of the landmarks' bone
    std::vector<std::string> remarks;
};

/// A case of a public data set, as far as it fits into memory; its X-rays are read one at a time.
struct ImportedCase {
    std::string title;
    Raster volume;
    std::optional<Raster> labels;
    std::vector<std::pair<std::string, std::string>> label_names;  ///< number, name
    std::vector<Landmark> landmarks;
    std::vector<std::string> views;
    std::function<ImportedView(const std::string&)> read_view;
    int border_px = 0;                     ///< masked at the rim of the X-rays; 0 = no mask
    std::string volume_flags;              ///< how `raylign` reads the volume, " --bone-threshold 1000"
    std::vector<std::string> conventions;  ///< of the data set, and what was done with them
};

/// Writes ct.mha, labels.mha and labels.csv, landmarks.csv and targets.json, per view VIEW.tif, points_VIEW.csv and
/// pose_VIEW_BONE.json, views.json of all views, views_VIEW.json of each where there are several, mask.tif and
/// README.md. Returns their names in this order.
std::vector<std::string> write_case(const ImportedCase& imported, OutputFolder& folder);

/// The names that write_case will take, for checks before the work: those of the poses are found when a view is read.
[[nodiscard]] std::vector<std::string> case_file_names(const ImportedCase& imported);

/// A raster of `size` (x fastest) from an array of the file's own; types that image files lack become float32.
[[nodiscard]] Raster raster_of(const struct Hdf5Array& array, const std::vector<int>& size, FileFormat format);

/// What users type: a view by its name or its number. Throws Error listing the views for another one.
[[nodiscard]] std::vector<std::string> chosen_views(const std::vector<std::string>& wanted,
                                                    const std::vector<std::string>& views, const std::string& where);

}  // namespace raylign::detail
