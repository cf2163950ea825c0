#include "core/io/files/file_format.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/files/regular_file.h"
#include "core/io/files/temporary_file.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::array<std::pair<std::string_view, FileFormat>, 17> kExtensions = {{
    {".nii", FileFormat::nifti},
    {".nii.gz", FileFormat::nifti},
    {".hdr", FileFormat::nifti},
    {".img", FileFormat::nifti},
    {".img.gz", FileFormat::nifti},
    {".mha", FileFormat::meta},
    {".mhd", FileFormat::meta},
    {".nrrd", FileFormat::nrrd},
    {".nhdr", FileFormat::nrrd},
    {".tif", FileFormat::tiff},
    {".tiff", FileFormat::tiff},
    {".png", FileFormat::png},
    {".jpg", FileFormat::jpeg},
    {".jpeg", FileFormat::jpeg},
    {".dcm", FileFormat::dicom},
    {".dicom", FileFormat::dicom},
    {".ima", FileFormat::dicom},
}};

}  // namespace

std::string format_name(FileFormat format) {
    switch (format) {
        case FileFormat::nifti:
            return "NIfTI";
        case FileFormat::meta:
            return "MetaImage";
        case FileFormat::nrrd:
            return "NRRD";
        case FileFormat::tiff:
            return "TIFF";
        case FileFormat::png:
            return "PNG";
        case FileFormat::jpeg:
            return "JPEG";
        case FileFormat::dicom:
            return "DICOM";
    }
    return {};
}

bool has_dicom_mark(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 132> head{};
    return file.read(head.data(), head.size()) && std::string_view(head.data() + 128, 4) == "DICM";
}

std::optional<FileFormat> format_of(const std::filesystem::path& path) {
    const std::string name = lower_case(path.filename().string());
    for (const auto& [extension, format] : kExtensions) {
        if (name.ends_with(extension)) return format;
    }
    if (looks_like_dicom(path)) return FileFormat::dicom;
    return std::nullopt;
}

void check_readable_file(const std::filesystem::path& path) {
    const Descriptor file = open_regular_file(path);
    char first = 0;
    const ssize_t count = ::read(file.number(), &first, 1);
    if (count < 0) throw Error(path.string() + " cannot be read: " + system_reason(errno));
    if (count == 0) throw Error(path.string() + " is empty (0 bytes)");
}

}  // namespace raylign::detail
