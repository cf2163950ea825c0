#include "core/io/files/one_eigen.h"

#include <itkCompositeTransform.h>
#include <itkEuler3DTransform.h>
#include <itkHDF5TransformIO.h>
#include <itkTransformFileWriter.h>
#include <itkTranslationTransform.h>
#include <itkTxtTransformIO.h>

#include "io_files.h"

namespace raylign::detail::test {
namespace {

/// One element of explicit VR: group, element, VR, length, value padded to even length.
std::string element(std::uint16_t group, std::uint16_t number, const std::string& vr, std::string value) {
    if (value.size() % 2 != 0) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
    const bool has_long_length = vr == "OB" || vr == "OW";
    const std::string length = has_long_length
                                   ? std::string(2, '\0') + bytes_of(static_cast<std::uint32_t>(value.size()))
                                   : bytes_of(static_cast<std::uint16_t>(value.size()));
    return bytes_of(group) + bytes_of(number) + vr + length + value;
}

void write_transforms(const std::filesystem::path& path,
                      const std::vector<itk::Transform<double, 3, 3>::Pointer>& transforms) {
    const auto writer = itk::TransformFileWriterTemplate<double>::New();
    const auto text = itk::TxtTransformIOTemplate<double>::New();
    const auto hdf5 = itk::HDF5TransformIOTemplate<double>::New();
    if (path.extension() == ".h5") {
        writer->SetTransformIO(hdf5);
    } else {
        writer->SetTransformIO(text);
    }
    writer->SetFileName(path.string());
    for (const auto& transform : transforms) writer->AddTransform(transform);
    writer->Update();
}

}  // namespace

std::string DicomBytes::with(const std::vector<std::uint16_t>& pixels) const {
    const std::string ct = "1.2.840.10008.5.1.4.1.1.2";
    const std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) + element(2, 2, "UI", ct) +
                             element(2, 3, "UI", instance_uid) + element(2, 0x10, "UI", "1.2.840.10008.1.2.1");
    const auto us = [](std::uint16_t group, std::uint16_t number, std::uint16_t value) {
        return element(group, number, "US", bytes_of(value));
    };
    std::string data = element(8, 0x16, "UI", ct) + element(8, 0x18, "UI", instance_uid) +
                       element(8, 0x60, "CS", "CT") + element(8, 0x103e, "LO", description) +
                       element(0x20, 0xe, "UI", series_uid) + element(0x20, 0x11, "IS", "4");
    if (!position.empty()) data += element(0x20, 0x32, "DS", position) + element(0x20, 0x37, "DS", orientation);
    data += us(0x28, 2, 1) + element(0x28, 4, "CS", photometric) + us(0x28, 0x10, rows) + us(0x28, 0x11, columns) +
            element(0x28, 0x30, "DS", pixel_spacing) + us(0x28, 0x100, 16) + us(0x28, 0x101, bits_stored) +
            us(0x28, 0x102, static_cast<std::uint16_t>(bits_stored - 1)) + us(0x28, 0x103, 0) +
            element(0x28, 0x1052, "DS", intercept) + element(0x28, 0x1053, "DS", slope) +
            element(0x7fe0, 0x10, "OW", bytes_of(pixels));
    return std::string(128, '\0') + "DICM" + element(2, 0, "UL", bytes_of(static_cast<std::uint32_t>(meta.size()))) +
           meta + data;
}

void write_itk_euler(const std::filesystem::path& path, double angle_rad, const std::vector<double>& centre_mm,
                     const std::vector<double>& shift_mm) {
    const auto euler = itk::Euler3DTransform<double>::New();
    euler->SetRotation(0, 0, angle_rad);
    itk::Point<double, 3> centre;
    itk::Vector<double, 3> shift;
    for (unsigned i = 0; i < 3; ++i) {
        centre[i] = centre_mm[i];
        shift[i] = shift_mm[i];
    }
    euler->SetCenter(centre);
    euler->SetTranslation(shift);
    write_transforms(path, {euler.GetPointer()});
}

Eigen::Vector3d write_itk_pair(const std::filesystem::path& path, const Eigen::Vector3d& point) {
    const auto shift = itk::TranslationTransform<double, 3>::New();
    itk::Vector<double, 3> offset;
    for (unsigned i = 0; i < 3; ++i) offset[i] = 10.0 * (i + 1);
    shift->SetOffset(offset);
    const auto euler = itk::Euler3DTransform<double>::New();
    itk::Point<double, 3> centre;
    for (unsigned i = 0; i < 3; ++i) centre[i] = i + 1.0;
    euler->SetCenter(centre);
    euler->SetRotation(0.25, -0.5, 0.125);
    const auto both = itk::CompositeTransform<double, 3>::New();
    both->AddTransform(shift);
    both->AddTransform(euler);
    const bool is_composite = path.filename().string().starts_with("composite");
    const std::vector<itk::Transform<double, 3, 3>::Pointer> parts{shift.GetPointer(), euler.GetPointer()};
    const std::vector<itk::Transform<double, 3, 3>::Pointer> whole{both.GetPointer()};
    write_transforms(path, is_composite ? whole : parts);
    itk::Point<double, 3> moved;
    for (unsigned i = 0; i < 3; ++i) moved[i] = point[i];
    moved = both->TransformPoint(moved);
    return {moved[0], moved[1], moved[2]};
}

}  // namespace raylign::detail::test
