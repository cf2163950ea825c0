#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <vector>

#include "raylign/image.h"
#include "raylign/intensity.h"

namespace raylign {

/// Reads a single-channel 2-D image: TIFF, PNG, JPEG, MHA/MHD, NRRD or DICOM. `frame` chooses among several
/// (multi-frame DICOM, TIFF pages, the third axis of a stack), from 1; 0 = there is but one. Throws Error for a file
/// that is missing, damaged or has colours, and for a frame that it has not.
[[nodiscard]] RawXray read_xray(const std::filesystem::path& path, int frame = 0);

/// A file with one or more frames whose pixels are kept as stored: frames become floats one at a time. One
/// XrayFile, one thread at a time. Throws Error for a file that cannot be read and a frame that it has not.
class XrayFile {
public:
    explicit XrayFile(const std::filesystem::path& path);
    ~XrayFile();
    XrayFile(const XrayFile&) = delete;
    XrayFile& operator=(const XrayFile&) = delete;

    [[nodiscard]] int frame_count() const;
    [[nodiscard]] RawXray frame(int number) const;  ///< from 1

private:
    struct Contents;
    std::unique_ptr<const Contents> contents_;
};

/// Columns and rows of such a file; its pixels are not read for that.
[[nodiscard]] Eigen::Vector2i xray_size_px(const std::filesystem::path& path);

/// How many frames such a file has. A DICOM file's pixels are not read for that.
[[nodiscard]] int xray_frame_count(const std::filesystem::path& path);

/// Float32 image (TIFF, MHA or NRRD by the extension), to a temporary name first. Throws Error where that cannot be
/// written.
void write_image(const std::filesystem::path& path, const Image& image);

}  // namespace raylign
