#include "core/io/geometry/stored_projection.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/base/linear_algebra.h"
#include "core/geometry/camera.h"
#include "core/io/files/text.h"
#include "core/io/geometry/distortion.h"

namespace raylign::detail {
namespace {

std::string size_words(const Eigen::Vector2i& size) {
    return std::to_string(size.x()) + " x " + std::to_string(size.y());
}

void check_finite(const StoredProjection& stored, const std::string& where) {
    if (!stored.pixel_from_world.allFinite()) throw Error("geometry in " + where + ": must be finite numbers");
    if (stored.sdd_mm && !(*stored.sdd_mm > 0)) {
        throw bad_value("sdd_mm", number_text(*stored.sdd_mm), "positive", where);
    }
}

}  // namespace

Matrix34 projection_of(const Eigen::Matrix3d& intrinsics_px, const Eigen::Matrix3d& rotation,
                       const Eigen::Vector3d& translation_mm) {
    Matrix34 extrinsics;
    extrinsics << rotation, translation_mm;
    return intrinsics_px * extrinsics;
}

Eigen::Matrix3d flip_matrix(ImageFlip flip, const Eigen::Vector2i& size_px) {
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
    if (flip == ImageFlip::none) return matrix;
    const int axis = flip == ImageFlip::columns ? 0 : 1;
    matrix(axis, axis) = -1;
    matrix(axis, 2) = size_px[axis] - 1;
    return matrix;
}

std::string_view flip_name(ImageFlip flip) {
    return flip == ImageFlip::none ? "none" : flip == ImageFlip::columns ? "columns" : "rows";
}

void flip_image(Image& image, ImageFlip flip) {
    if (flip == ImageFlip::none || image.empty()) return;
    const auto row = [&](int y) { return image.pixels.begin() + static_cast<std::ptrdiff_t>(y) * image.width; };
    if (flip == ImageFlip::columns) {
        for (int y = 0; y < image.height; ++y) std::reverse(row(y), row(y + 1));
        return;
    }
    for (int y = 0; y < image.height / 2; ++y) std::swap_ranges(row(y), row(y + 1), row(image.height - 1 - y));
}

GeometryView finish_view(StoredProjection stored, const GeometryHints& hints, const std::string& name,
                         const std::string& where) {
    check_finite(stored, where);
    GeometryView view;
    view.name = name;
    view.flip = hints.flip.value_or(stored.own_flip.value_or(ImageFlip::none));
    view.assumptions = std::move(stored.assumptions);
    const Matrix34 pixel_from_world = flip_matrix(view.flip, stored.size_px) * stored.pixel_from_world;
    const double determinant = determinant_of(pixel_from_world.leftCols<3>());
    if (determinant < 0) {
        const bool is_flipped = view.flip != ImageFlip::none;
        throw Error("the image of " + where + " is mirrored: its columns, rows and viewing direction are left-handed" +
                    (is_flipped ? " after the flip of its " + std::string(flip_name(view.flip)) +
                                      "; give \"flip\": \"none\" if it was not stored mirrored"
                                : "; if that is so, give \"flip\": \"columns\" (or \"rows\") to turn the pixels on "
                                  "reading, else mend the file"));
    }
    view.geometry = view_from_projection_matrix(pixel_from_world, stored.size_px, where);
    view.geometry.camera.sdd_mm = stored.sdd_mm;
    // Rounding of the decomposition: a skew of 1e-10 px is none.
    if (std::abs(view.geometry.camera.intrinsics_px(0, 1)) < 1e-9 * view.geometry.camera.intrinsics_px(0, 0)) {
        view.geometry.camera.intrinsics_px(0, 1) = 0;
    }
    check_camera(view.geometry.camera, where);
    if (stored.distortion) view.distortion = flipped(*stored.distortion, view.flip);
    if (view.flip != ImageFlip::none) {
        view.assumptions.push_back("the stored image is mirrored against the view from the source: its " +
                                   std::string(flip_name(view.flip)) + " are reversed on reading" +
                                   (hints.flip ? ", as asked for" : ""));
    }
    return view;
}

Eigen::Vector2i settled_size(const std::optional<Eigen::Vector2i>& stated, const GeometryHints& hints,
                             const std::string& where) {
    if (stated && hints.size_px && *stated != *hints.size_px) {
        throw bad_value("image size", size_words(*stated), "like the image's or size_px, " + size_words(*hints.size_px),
                        where);
    }
    const std::optional<Eigen::Vector2i> size = stated ? stated : hints.size_px;
    if (!size) throw Error(where + " does not say the image's size: give an image or size_px");
    constexpr int kLargest = 65536;  // per side; more is a slip of the pen
    if (size->minCoeff() < 1 || size->maxCoeff() > kLargest) {
        throw bad_value("image size", size_words(*size), "in [1, 65536] per side", where);
    }
    return *size;
}

std::optional<Distortion> settled_distortion(const std::optional<Distortion>& stated, const GeometryHints& hints,
                                             std::vector<std::string>& assumptions) {
    if (!stated) return std::nullopt;
    if (hints.undistorted.value_or(false)) {
        assumptions.push_back("the images come undistorted, as said: the file's distortion (" +
                              distortion_text(*stated) + ") is not undone again");
        return std::nullopt;
    }
    assumptions.push_back(
        "images, masks and points are undistorted on reading (" + distortion_text(*stated) +
        "); pixels that the stored image does not show get weight 0. Not so if images come undistorted: "
        "then say so (docs/formats.md, Distortion)");
    return stated;
}

void refuse_transposed(const Eigen::Matrix3d& k, const std::string& name, const std::string& where) {
    const bool is_transposed = (k(2, 0) != 0 || k(2, 1) != 0) && k(0, 2) == 0 && k(1, 2) == 0 && k(2, 2) != 0;
    if (!is_transposed) return;
    throw Error(name + " in " + where + " is stored transposed, as MATLAB does: its last row is (" +
                number_text(k(2, 0)) + ", " + number_text(k(2, 1)) + ", " + number_text(k(2, 2)) +
                "). The principal point must stand in the last column, counted from 0 at the first pixel's centre "
                "(MATLAB counts from 1: take 1 off)");
}

void check_orthonormal(const Eigen::Matrix3d& rotation, const std::string& where) {
    const double departure = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(departure <= 1e-4)) {
        throw bad_value("departure of the rotation from an orthonormal matrix", number_text(departure), "at most 1e-4",
                        where);
    }
}

void refuse_hint(bool is_given, std::string_view what, std::string_view format, const std::string& where) {
    if (!is_given) return;
    throw Error(std::string(what) + " with " + where + ": must be left out, " + std::string(format) +
                " says it itself or has no use for it");
}

}  // namespace raylign::detail
