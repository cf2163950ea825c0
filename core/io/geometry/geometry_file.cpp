#include "raylign/io/geometry.h"

#include <algorithm>
#include <array>
#include <fstream>

#include "core/base/error.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"
#include "core/io/files/text_file.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/number_text_reader.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;

std::string_view format_name(GeometryFormat format) {
    switch (format) {
        case GeometryFormat::mayacam1:
            return "MayaCam 1";
        case GeometryFormat::mayacam2:
            return "MayaCam 2";
        case GeometryFormat::rtk:
            return "RTK XML";
        case GeometryFormat::plastimatch:
            return "plastimatch matrix";
        case GeometryFormat::opencv:
            return "OpenCV YAML";
        case GeometryFormat::dicom:
            return "DICOM";
        case GeometryFormat::jointtrack:
            return "JointTrack calibration";
        case GeometryFormat::autoscoper:
            return "Autoscoper trial";
        case GeometryFormat::vectors:
            return "vectors";
    }
    return {};
}

namespace {

/// By its first bytes: an XML file may be large. Throws Error for OpenCV's, which is not read.
bool is_xml(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 4096> bytes{};
    file.read(bytes.data(), bytes.size());
    std::string_view head(bytes.data(), static_cast<std::size_t>(file.gcount()));
    detail::refuse_utf16(head, path);
    if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
    head = detail::trimmed(head);
    if (head.find("<opencv_storage") != std::string_view::npos) {
        throw Error(path.string() + " is OpenCV's XML: write it as YAML (FileStorage to a name ending in .yml)");
    }
    return head.starts_with('<');
}

}  // namespace

GeometryFormat geometry_format_of(const std::filesystem::path& path) {
    detail::check_readable_file(path);
    if (detail::looks_like_dicom(path)) return GeometryFormat::dicom;
    if (is_xml(path)) return GeometryFormat::rtk;
    const std::vector<detail::TextLine> lines = detail::text_lines(path);
    const std::string& first = lines.front().text;
    const auto mentions = [&](std::string_view word) {
        return std::ranges::any_of(lines, [&](const auto& line) { return line.text.find(word) != std::string::npos; });
    };
    if (first.starts_with("%YAML") || mentions("opencv-matrix")) return GeometryFormat::opencv;
    if (detail::lower_case(first) == "image size") return GeometryFormat::mayacam2;
    if (first.starts_with("JT_INTCALIB") || first.starts_with("JTA_INTCALIB")) return GeometryFormat::jointtrack;
    if (mentions("mayaCam_csv")) return GeometryFormat::autoscoper;
    if (detail::is_vectors_table(path)) return GeometryFormat::vectors;
    const auto commas = std::ranges::count(first, ',');
    if (lines.size() == 5 && commas >= 2) return GeometryFormat::mayacam1;
    const std::string extension = detail::lower_case(path.extension().string());
    if (extension == ".yml" || extension == ".yaml") return GeometryFormat::opencv;
    if (mentions("Extrinsic") ||
        (commas == 0 && lines.size() >= 7 && detail::number_from(first.substr(0, first.find_first_of(" \t"))))) {
        return GeometryFormat::plastimatch;
    }
    throw bad_value("geometry format", "unknown",
                    "views.json, MayaCam 1 or 2, RTK XML, plastimatch's matrix, OpenCV YAML, a table of vectors, "
                    "JointTrack's calibration, an "
                    "Autoscoper trial or a DICOM X-ray",
                    path.string());
}

std::vector<GeometryView> read_geometry(const std::filesystem::path& path, const GeometryHints& hints) {
    const GeometryFormat format = geometry_format_of(path);
    const bool has_no_use = format == GeometryFormat::dicom || format == GeometryFormat::jointtrack;
    detail::refuse_hint(has_no_use && hints.undistorted, "undistorted", format_name(format), path.string());
    switch (format) {
        case GeometryFormat::mayacam1:
            return detail::read_mayacam1(path, hints);
        case GeometryFormat::mayacam2:
            return detail::read_mayacam2(path, hints);
        case GeometryFormat::rtk:
            return detail::read_rtk(path, hints);
        case GeometryFormat::plastimatch:
            return detail::read_plastimatch(path, hints);
        case GeometryFormat::opencv:
            return detail::read_opencv(path, hints);
        case GeometryFormat::dicom:
            return detail::read_dicom_geometry(path, hints);
        case GeometryFormat::jointtrack:
            return detail::read_jointtrack(path, hints);
        case GeometryFormat::autoscoper:
            return detail::read_autoscoper_cameras(path, hints);
        case GeometryFormat::vectors:
            return detail::read_vectors(path, hints);
    }
    return {};
}

}  // namespace raylign
