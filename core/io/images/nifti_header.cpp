#include "core/io/images/nifti_header.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>

#include "core/base/error.h"
#include "core/io/files/byte_source.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kBytes1 = 348, kBytes2 = 540;  // of the two headers

/// Fields by their offsets in nifti1.h and nifti2.h.
class Fields {
public:
    Fields(std::span<const std::byte> bytes, bool is_big_endian)
        : bytes_(bytes), is_swapped_(is_big_endian != (std::endian::native == std::endian::big)) {}

    template <typename T>
    [[nodiscard]] T at(std::size_t offset) const {
        std::array<std::byte, sizeof(T)> raw;
        std::ranges::copy(bytes_.subspan(offset, sizeof(T)), raw.begin());
        if (is_swapped_) std::ranges::reverse(raw);
        return std::bit_cast<T>(raw);
    }
    [[nodiscard]] std::string_view text(std::size_t offset, std::size_t length) const {
        return {reinterpret_cast<const char*>(bytes_.data()) + offset, length};
    }

private:
    std::span<const std::byte> bytes_;
    bool is_swapped_;
};

template <typename Integer>
std::vector<int> sizes(const Fields& fields, std::size_t offset, const std::string& name) {
    const auto dimensions = static_cast<std::int64_t>(fields.at<Integer>(offset));
    if (dimensions < 1 || dimensions > 7) throw bad_value("dim[0]", std::to_string(dimensions), "in [1, 7]", name);
    std::vector<int> size;
    for (std::size_t i = 1; i <= static_cast<std::size_t>(dimensions); ++i) {
        const auto n = static_cast<std::int64_t>(fields.at<Integer>(offset + i * sizeof(Integer)));
        if (n < 1 || n > std::numeric_limits<int>::max()) {
            throw bad_value("dim[" + std::to_string(i) + "]", std::to_string(n), "in [1, 2147483647]", name);
        }
        size.push_back(static_cast<int>(n));
    }
    return size;
}

/// Quaternion, offset and sform lie in a row in both headers.
template <typename Float>
void take_forms(const Fields& fields, std::size_t offset, NiftiHeader& header) {
    const auto number = [&](int i) {
        return static_cast<double>(fields.at<Float>(offset + static_cast<std::size_t>(i) * sizeof(Float)));
    };
    for (int i = 0; i < 3; ++i) {
        header.quaternion[i] = number(i);
        header.qoffset[i] = number(3 + i);
        for (int column = 0; column < 4; ++column) header.srow(i, column) = number(6 + 4 * i + column);
    }
}

NiftiHeader parse_1(const Fields& fields, const std::string& name) {
    NiftiHeader header;
    header.is_single_file = fields.text(344, 3) == "n+1";
    header.size = sizes<std::int16_t>(fields, 40, name);
    header.datatype = fields.at<std::int16_t>(70);
    for (std::size_t i = 0; i < 4; ++i) header.pixdim[i] = fields.at<float>(76 + 4 * i);
    header.vox_offset = fields.at<float>(108);
    header.scl_slope = fields.at<float>(112);
    header.scl_inter = fields.at<float>(116);
    header.xyzt_units = fields.at<std::uint8_t>(123);
    header.qform_code = fields.at<std::int16_t>(252);
    header.sform_code = fields.at<std::int16_t>(254);
    take_forms<float>(fields, 256, header);
    return header;
}

NiftiHeader parse_2(const Fields& fields, const std::string& name) {
    NiftiHeader header;
    header.is_second = true;
    header.is_single_file = fields.text(4, 3) == "n+2";
    header.datatype = fields.at<std::int16_t>(12);
    header.size = sizes<std::int64_t>(fields, 16, name);
    for (std::size_t i = 0; i < 4; ++i) header.pixdim[i] = fields.at<double>(104 + 8 * i);
    header.vox_offset = static_cast<double>(fields.at<std::int64_t>(168));
    header.scl_slope = fields.at<double>(176);
    header.scl_inter = fields.at<double>(184);
    header.qform_code = fields.at<std::int32_t>(344);
    header.sform_code = fields.at<std::int32_t>(348);
    take_forms<double>(fields, 352, header);
    header.xyzt_units = fields.at<std::int32_t>(500);
    return header;
}

/// The first header of `names` beside `path` that there is; the first of all where there is none.
std::filesystem::path beside(const std::filesystem::path& path, std::string_view end,
                             std::initializer_list<std::string_view> ends) {
    const std::string name = path.filename().string();
    const std::string stem = name.substr(0, name.size() - end.size());
    std::filesystem::path first;
    for (const std::string_view other : ends) {
        for (const bool is_upper : {false, true}) {
            std::string last(other);
            if (is_upper) std::ranges::transform(last, last.begin(), [](char c) { return c >= 'a' ? c - 32 : c; });
            const std::filesystem::path file = std::filesystem::path(path).replace_filename(stem + last);
            if (first.empty()) first = file;
            if (std::filesystem::exists(file)) return file;
        }
    }
    return first;
}

void find_files(const std::filesystem::path& path, NiftiHeader& header) {
    const std::string name = lower_case(path.filename().string());
    header.header_file = header.voxel_file = path;
    if (name.ends_with(".img")) header.header_file = beside(path, ".img", {".hdr", ".hdr.gz"});
    if (name.ends_with(".img.gz")) header.header_file = beside(path, ".img.gz", {".hdr", ".hdr.gz"});
    if (name.ends_with(".hdr")) header.voxel_file = beside(path, ".hdr", {".img", ".img.gz"});
}

/// The voxels' offset in its range; 0 in a single file, as some writers leave it, means right after the header.
void settle_offset(NiftiHeader& header, const std::string& name) {
    const double least = header.is_single_file ? static_cast<double>(header.is_second ? kBytes2 : kBytes1) + 4 : 0;
    if (header.vox_offset == 0) header.vox_offset = least;
    constexpr double kMost = 1e12;
    if (header.vox_offset >= least && header.vox_offset <= kMost &&
        header.vox_offset == std::round(header.vox_offset)) {
        return;
    }
    throw bad_value("vox_offset", number_text(header.vox_offset),
                    "a whole number from " + number_text(least) + " up to the file's size", name);
}

/// What follows the header: at most 16 MiB of it, the label names of a map are far shorter.
std::string extension_after(ByteSource& source, const NiftiHeader& header, std::size_t header_bytes) {
    constexpr double kMost = 1 << 24;
    const double stated = header.is_single_file ? header.vox_offset - static_cast<double>(header_bytes) : kMost;
    std::string text(static_cast<std::size_t>(std::min(stated, kMost)), '\0');
    text.resize(source.read(std::as_writable_bytes(std::span(text))));
    return text;
}

}  // namespace

NiftiHeader read_nifti_header(const std::filesystem::path& path) {
    const std::string name = path.string();
    NiftiHeader files;
    find_files(path, files);
    check_readable_file(files.header_file);
    const bool is_packed = is_gzip(files.header_file);
    if (lower_case(files.header_file.string()).ends_with(".gz") && !is_packed) {
        throw Error(files.header_file.string() + " is not a gzip file");
    }
    ByteSource source(files.header_file, 0, is_packed ? Packing::deflate : Packing::none);
    std::array<std::byte, kBytes2> bytes{};
    if (source.read(std::span(bytes).first(kBytes1)) != kBytes1) {
        throw Error(name + " is too short for a NIfTI header (348 bytes)");
    }
    const auto states = [&](bool is_big_endian, std::size_t size) {
        return Fields(bytes, is_big_endian).at<std::int32_t>(0) == static_cast<std::int32_t>(size);
    };
    const bool is_big_endian = states(true, kBytes1) || states(true, kBytes2);
    const Fields fields(bytes, is_big_endian);
    const bool is_first =
        states(is_big_endian, kBytes1) && (fields.text(344, 3) == "n+1" || fields.text(344, 3) == "ni1");
    const bool is_second = states(is_big_endian, kBytes2) && (fields.text(4, 3) == "n+2" || fields.text(4, 3) == "ni2");
    if (!is_first && !is_second) {
        throw Error(name + " is not a NIfTI-1 or NIfTI-2 file (Analyze is not read: it does not say where voxels lie)");
    }
    if (is_second && source.read(std::span(bytes).subspan(kBytes1)) != kBytes2 - kBytes1) {
        throw Error(name + " is too short for a NIfTI-2 header (540 bytes)");
    }
    NiftiHeader header = is_second ? parse_2(fields, name) : parse_1(fields, name);
    header.is_big_endian = is_big_endian;
    header.header_file = files.header_file;
    header.voxel_file = header.is_single_file ? files.header_file : files.voxel_file;
    settle_offset(header, name);
    header.extension = extension_after(source, header, is_second ? kBytes2 : kBytes1);
    return header;
}

}  // namespace raylign::detail
