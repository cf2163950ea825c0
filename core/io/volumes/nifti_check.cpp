#include "core/io/volumes/nifti_check.h"

#include <zlib.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

constexpr std::size_t kHeaderBytes = 348;
constexpr std::int16_t kFloat32 = 16, kFloat64 = 64;  // NIfTI datatype codes

using GzFile = std::unique_ptr<gzFile_s, decltype(&gzclose)>;

/// Plain .nii files are read as they are, so one way of reading serves .nii and .nii.gz.
GzFile open(const std::filesystem::path& path) {
    GzFile file(gzopen(path.c_str(), "rb"), &gzclose);
    if (!file) throw Error(path.string() + " cannot be opened");
    if (lower_case(path.string()).ends_with(".gz") && gzdirect(file.get()) != 0) {
        throw Error(path.string() + " is not a gzip file");
    }
    return file;
}

template <typename T>
T value_at(std::span<const std::byte> bytes, std::size_t offset, bool swapped) {
    std::array<std::byte, sizeof(T)> raw;
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(offset), sizeof(T), raw.begin());
    if (swapped) std::ranges::reverse(raw);
    return std::bit_cast<T>(raw);
}

/// The fields that are checked. Offsets are those of nifti1.h.
struct Header {
    bool swapped = false, data_follows = false;
    int dimensions = 0;
    std::int16_t datatype = 0, sform_code = 0;
    std::array<float, 3> spacing{};
    Eigen::Matrix3d sform;
    double data_offset = 0;
    std::uint64_t voxels = 1, voxel_bytes = 1;
};

Header parse(std::span<const std::byte> bytes, const std::string& name) {
    Header header;
    header.swapped = value_at<std::int32_t>(bytes, 0, false) != static_cast<std::int32_t>(kHeaderBytes);
    const std::string_view magic(reinterpret_cast<const char*>(bytes.data()) + 344, 3);
    if (value_at<std::int32_t>(bytes, 0, header.swapped) != static_cast<std::int32_t>(kHeaderBytes) ||
        (magic != "n+1" && magic != "ni1")) {
        throw Error(name + " is not a NIfTI-1 file (NIfTI-2 and Analyze are not read)");
    }
    header.data_follows = magic == "n+1";
    header.dimensions = value_at<std::int16_t>(bytes, 40, header.swapped);
    for (int i = 0; i < std::clamp(header.dimensions, 0, 7); ++i) {
        const auto n = value_at<std::int16_t>(bytes, 42 + 2 * static_cast<std::size_t>(i), header.swapped);
        if (n < 1) throw bad_value("dim[" + std::to_string(i + 1) + "]", std::to_string(n), "at least 1", name);
        header.voxels *= static_cast<std::uint64_t>(n);
    }
    header.datatype = value_at<std::int16_t>(bytes, 70, header.swapped);
    const auto bits = value_at<std::int16_t>(bytes, 72, header.swapped);
    if (bits < 8 || bits > 256 || bits % 8 != 0)
        throw bad_value("bitpix", std::to_string(bits), "8, 16, 32 or 64", name);
    header.voxel_bytes = static_cast<std::uint64_t>(bits) / 8;
    for (std::size_t i = 0; i < 3; ++i) header.spacing[i] = value_at<float>(bytes, 80 + 4 * i, header.swapped);
    header.data_offset = value_at<float>(bytes, 108, header.swapped);
    header.sform_code = value_at<std::int16_t>(bytes, 254, header.swapped);
    for (std::size_t i = 0; i < 9; ++i) {
        header.sform(static_cast<int>(i / 3), static_cast<int>(i % 3)) =
            value_at<float>(bytes, 280 + 16 * (i / 3) + 4 * (i % 3), header.swapped);
    }
    return header;
}

void check_geometry(const Header& header, const std::string& name) {
    for (int i = 0; i < std::min(3, header.dimensions); ++i) {
        const float spacing = header.spacing[static_cast<std::size_t>(i)];
        if (spacing > 0 && std::isfinite(spacing)) continue;
        throw bad_value("voxel spacing along " + std::string(1, "xyz"[i]), number_text(spacing), "positive", name);
    }
    if (header.sform_code <= 0 || header.dimensions < 3) return;
    constexpr double kTolerance = 1e-3;  // srow_* are floats, often from text of four digits
    const Eigen::Matrix3d axes = header.sform.colwise().normalized();
    const double departure = (axes.transpose() * axes - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(departure < kTolerance)) {
        throw bad_value("departure of the sform's axes from right angles", number_text(departure), "below 1e-3", name);
    }
}

template <typename T>
std::ptrdiff_t first_non_finite(std::span<const std::byte> bytes, bool swapped) {
    for (std::size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T)) {
        if (!std::isfinite(value_at<T>(bytes, i, swapped))) return static_cast<std::ptrdiff_t>(i / sizeof(T));
    }
    return -1;
}

std::ptrdiff_t first_non_finite(std::span<const std::byte> bytes, const Header& header) {
    if (header.datatype == kFloat32) return first_non_finite<float>(bytes, header.swapped);
    if (header.datatype == kFloat64) return first_non_finite<double>(bytes, header.swapped);
    return -1;
}

/// Reads all voxels once. For .nii.gz this inflates the file a second time, about a second for a large CT.
void check_voxels(gzFile_s* file, const Header& header, const std::string& name) {
    std::vector<std::byte> block(1 << 20);
    std::uint64_t bytes_left = header.voxels * header.voxel_bytes;
    for (std::uint64_t done = 0; bytes_left > 0;) {
        const auto wanted = static_cast<unsigned>(std::min<std::uint64_t>(block.size(), bytes_left));
        if (gzread(file, block.data(), wanted) != static_cast<int>(wanted)) {
            throw Error(name + " is truncated or damaged: its header states " + std::to_string(header.voxels) +
                        " voxels");
        }
        const std::ptrdiff_t bad = first_non_finite({block.data(), wanted}, header);
        if (bad >= 0) {
            throw bad_value("voxel number " + std::to_string(done + static_cast<std::uint64_t>(bad)), "NaN or Inf",
                            "finite", name);
        }
        done += wanted / header.voxel_bytes;
        bytes_left -= wanted;
    }
}

/// foo.img's header is foo.hdr beside it.
std::filesystem::path header_file(std::filesystem::path path) {
    const std::string name = path.filename().string();
    const std::size_t at = lower_case(name).rfind(".img");
    if (at == std::string::npos) return path;
    std::string header = name;
    header.replace(at, 4, name[at + 1] == 'I' ? ".HDR" : ".hdr");
    return path.replace_filename(header);
}

}  // namespace

void check_nifti(const std::filesystem::path& path) {
    const std::string name = path.string();
    const GzFile file = open(header_file(path));
    std::vector<std::byte> bytes(kHeaderBytes);
    if (gzread(file.get(), bytes.data(), kHeaderBytes) != static_cast<int>(kHeaderBytes)) {
        throw Error(name + " is too short for a NIfTI header (348 bytes)");
    }
    const Header header = parse(bytes, name);
    check_geometry(header, name);
    const GzFile voxels = header.data_follows ? GzFile(nullptr, &gzclose) : open(path);
    gzFile_s* data = header.data_follows ? file.get() : voxels.get();
    if (gzseek(data, static_cast<z_off_t>(header.data_offset), SEEK_SET) < 0) {
        throw Error(name + " is truncated or damaged before its first voxel");
    }
    check_voxels(data, header, name);
}

}  // namespace raylign::detail
