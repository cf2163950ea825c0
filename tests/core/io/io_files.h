#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Core>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/errors.h"

namespace raylign::detail::test {

/// A folder of its own for each test, removed afterwards.
class IoTest : public testing::Test {
protected:
    void SetUp() override {
        const auto* info = testing::UnitTest::GetInstance()->current_test_info();
        folder_ = std::filesystem::path(testing::TempDir()) /
                  ("raylign_" + std::to_string(::getpid()) + "_" + info->test_suite_name() + "_" + info->name());
        std::filesystem::remove_all(folder_);
        std::filesystem::create_directories(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    [[nodiscard]] std::filesystem::path at(const std::string& name) const { return folder_ / name; }
    std::filesystem::path write(const std::string& name, const std::string& bytes) const {
        std::ofstream(at(name), std::ios::binary) << bytes;
        return at(name);
    }

    std::filesystem::path folder_;
};

template <typename T>
std::string bytes_of(const T& value) {
    return {reinterpret_cast<const char*>(&value), sizeof(T)};
}
template <typename T>
std::string bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string content_of(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
}

/// A 3 x 2 x 2 MetaImage of int16 unless told otherwise.
struct MetaText {
    std::string dims = "3 2 2", spacing = "0.5 0.75 2", matrix = "1 0 0 0 1 0 0 0 1", type = "MET_SHORT", more;
    int dimensions = 3;
    [[nodiscard]] std::string with(const std::string& voxels) const {
        return "ObjectType = Image\nNDims = " + std::to_string(dimensions) + "\nBinaryData = True\n" +
               "BinaryDataByteOrderMSB = False\nTransformMatrix = " + matrix + "\nOffset = " + offset() + "\n" + more +
               "ElementSpacing = " + spacing + "\nDimSize = " + dims + "\nElementType = " + type +
               "\nElementDataFile = LOCAL\n" + voxels;
    }
    [[nodiscard]] std::string offset() const { return dimensions == 2 ? "1 2" : dimensions == 3 ? "1 2 3" : "1 2 3 0"; }
};

/// A NIfTI-1 file of 3 x 2 x 2 int16 voxels unless told otherwise; sform rows in RAS.
struct NiftiBytes {
    std::vector<std::int16_t> dim = {3, 3, 2, 2, 1, 1, 1, 1};
    std::int16_t datatype = 4, bitpix = 16;
    std::vector<float> pixdim = {1, 0.5F, 0.75F, 2, 1, 1, 1, 1};
    std::vector<float> sform = {0.5F, 0, 0, 10, 0, 0.75F, 0, 20, 0, 0, 2, 30};
    std::vector<float> qform = {0, 0, 0, 10, 20, 30};  // quaternion b, c, d and offset
    std::int16_t qform_code = 0, sform_code = 1;
    std::vector<float> offset_slope_intercept = {352, 1, 0};
    char units = 2;  // mm
    std::string extension;
    [[nodiscard]] std::string with(const std::string& voxels) const {
        std::string header(352, '\0');
        const auto put = [&](std::size_t offset, const std::string& bytes) {
            header.replace(offset, bytes.size(), bytes);
        };
        put(0, bytes_of(std::int32_t{348}));
        put(40, bytes_of(dim));
        put(70, bytes_of(datatype));
        put(72, bytes_of(bitpix));
        put(76, bytes_of(pixdim));
        put(108, bytes_of(offset_slope_intercept));
        put(123, std::string(1, units));
        put(252, bytes_of(qform_code));
        put(254, bytes_of(sform_code));
        put(256, bytes_of(qform));
        put(280, bytes_of(sform));
        put(344, std::string("n+1", 4));
        return header + extension + voxels;
    }
};

/// -1000, -900, ... HU: the 12 voxels of the small volumes above.
inline std::vector<std::int16_t> small_hu() {
    return {-1000, -900, -899, -500, -100, 0, 100, 500, 1000, 1500, 2000, 3071};
}

/// One DICOM file, explicit little endian, 16-bit unsigned pixels (signed by `is_signed`), written element by element.
struct DicomBytes {
    std::string series_uid = "1.2.3.1", description = "small series", instance_uid = "1.2.3.1.1";
    std::string position = "0\\0\\0", orientation = "1\\0\\0\\0\\1\\0", pixel_spacing = "0.75\\0.5";
    std::string photometric = "MONOCHROME2", slope = "1", intercept = "-1024";
    std::uint16_t columns = 3, rows = 2, bits_stored = 12;
    [[nodiscard]] std::string with(const std::vector<std::uint16_t>& pixels) const;
};

/// Writes Euler3D (rotated about z by `angle_rad` about `centre_mm`, moved by `shift_mm`) through ITK; .h5 or .tfm.
void write_itk_euler(const std::filesystem::path& path, double angle_rad, const std::vector<double>& centre_mm,
                     const std::vector<double>& shift_mm);
/// Writes a translation and a turn, as a CompositeTransform where the file's name begins with "composite"; .h5 or .tfm.
/// Returns where ITK's CompositeTransform of them puts `point`.
Eigen::Vector3d write_itk_pair(const std::filesystem::path& path, const Eigen::Vector3d& point);

}  // namespace raylign::detail::test
