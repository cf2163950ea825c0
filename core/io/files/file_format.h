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

/// Throws Error with the system's reason where the file is missing, a folder, empty or may not be read.
void check_readable_file(const std::filesystem::path& path);

}  // namespace raylign::detail
