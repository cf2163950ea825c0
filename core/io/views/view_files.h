#pragma once

#include <filesystem>
#include <string>

#include "raylign/io/views.h"

namespace raylign::detail {

/// The files of one view and how to take their pixels.
struct ViewFiles {
    std::filesystem::path image, mask;  ///< "" = none
    IntensitySettings intensity;
    int frame = 0;                  ///< of the image, from 1; 0 = there is but one
    std::vector<FrameFile> frames;  ///< with ReadImages::frames
};

/// Pixels as stored.
struct ViewPixels {
    RawXray xray;
    Image mask;
};

/// Reads what `images` asks for and lists it in `result.files`. `where` names the view. Throws Error where an image is
/// required and none is named.
[[nodiscard]] ViewPixels read_view_pixels(const ViewFiles& files, ReadImages images, const std::string& where,
                                          ViewsFile& result);

/// Columns and rows of the first frame that can be read: one that cannot is a gap later. Throws what is wrong with the
/// first where that holds for all (of very many: for the first hundred).
[[nodiscard]] Eigen::Vector2i frame_size_px(const std::vector<FrameFile>& frames);

/// Puts the view together: checks sizes, turns the pixels, makes line integrals of them, and appends it to `result`
/// with its origin and notes. Throws Error for sizes that differ and for a name that is taken already.
void append_view(const std::string& name, const GeometryView& geometry, ViewPixels pixels, const ViewFiles& files,
                 const std::string& where, ViewsFile& result);

/// Whether a view of `result` has this name, whatever the case: some file systems do not tell AP from ap.
[[nodiscard]] bool is_name_taken(const std::string& name, const ViewsFile& result);

/// Letters, digits, '_', '-' and '.' only: the name becomes part of file names.
[[nodiscard]] bool is_view_name(const std::string& name);

}  // namespace raylign::detail
