#pragma once

#include <string>
#include <vector>

#include "raylign/image.h"
#include "raylign/io/geometry.h"

namespace raylign::detail {

using Matrix34 = Eigen::Matrix<double, 3, 4>;

/// The projection of a file's pixels as stored, before any flip.
struct StoredProjection {
    Matrix34 pixel_from_world = Matrix34::Zero();  ///< third row: positive in front of the source
    Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
    std::optional<double> sdd_mm;
    std::optional<Distortion> distortion;  ///< of the pixels as stored
    std::optional<ImageFlip> own_flip;     ///< what the format asks for; empty: pixels are as seen from the source
    std::vector<std::string> assumptions;
};

/// K [R | t] with any 3x3 R: a mirrored one is found in finish_view.
[[nodiscard]] Matrix34 projection_of(const Eigen::Matrix3d& intrinsics_px, const Eigen::Matrix3d& rotation,
                                     const Eigen::Vector3d& translation_mm);

/// pixel' from pixel for an image of this size.
[[nodiscard]] Eigen::Matrix3d flip_matrix(ImageFlip flip, const Eigen::Vector2i& size_px);

[[nodiscard]] std::string_view flip_name(ImageFlip flip);

/// Reverses columns or rows in place.
void flip_image(Image& image, ImageFlip flip);

/// The camera of the flipped image. Throws Error where the image is mirrored: its determinant is negative, columns,
/// rows and viewing direction left-handed, and offers the flip that mends it.
[[nodiscard]] GeometryView finish_view(StoredProjection stored, const GeometryHints& hints, const std::string& name,
                                       const std::string& where);

/// The size that the file states, checked against the hint; or the hint; throws Error where neither is there.
[[nodiscard]] Eigen::Vector2i settled_size(const std::optional<Eigen::Vector2i>& stated, const GeometryHints& hints,
                                           const std::string& where);

/// The distortion to be undone on reading: the file's, unless the hints say that the images come undistorted. Says so.
[[nodiscard]] std::optional<Distortion> settled_distortion(const std::optional<Distortion>& stated,
                                                           const GeometryHints& hints,
                                                           std::vector<std::string>& assumptions);

/// Throws Error where the principal point stands in the last row of K, as MATLAB keeps it.
void refuse_transposed(const Eigen::Matrix3d& intrinsics_px, const std::string& name, const std::string& where);

/// Throws Error unless R^T R = 1 within 1e-4 (text files carry few digits); its sign is finish_view's business.
void check_orthonormal(const Eigen::Matrix3d& rotation, const std::string& where);

/// Throws Error unless `hints` leaves this out.
void refuse_hint(bool is_given, std::string_view what, std::string_view format, const std::string& where);

}  // namespace raylign::detail
