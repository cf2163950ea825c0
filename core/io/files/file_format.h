#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace raylign::detail {

enum class FileFormat { nifti, meta, nrrd, tiff, png, jpeg, dicom };
[[nodiscard]] std::string format_name(FileFormat format);

/// By the extension, in any case of letters; files with another extension, or none, by DICOM's mark at byte 128.
[[nodiscard]] std::optional<FileFormat> format_of(const std::filesystem::path& path);

[[nodiscard]] bool has_dicom_mark(const std::filesystem::path& path);

/// The one rule for every input file: throws Error, with the system's reason, where it is missing, empty, may not be
/// read, or is no regular file (a folder, FIFO, socket or device; /dev/stdin is one where a file was redirected to it).
void check_readable_file(const std::filesystem::path& path);

}  // namespace raylign::detail
