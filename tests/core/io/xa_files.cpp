#include "xa_files.h"

#include "core/io/files/one_eigen.h"

#include <itkGDCMImageIO.h>
#include <itkMetaDataObject.h>

#include <cstdio>

#include "io_files.h"

namespace raylign::detail::test {
namespace {

std::string element(std::uint32_t tag, const std::string& vr, std::string value) {
    if (value.size() % 2 != 0) value += vr == "UI" || vr == "OB" ? '\0' : ' ';
    const bool is_long = vr == "OB" || vr == "OW" || vr == "SQ";
    const auto group = static_cast<std::uint16_t>(tag >> 16), number = static_cast<std::uint16_t>(tag & 0xffff);
    const std::string length = is_long ? std::string(2, '\0') + bytes_of(static_cast<std::uint32_t>(value.size()))
                                       : bytes_of(static_cast<std::uint16_t>(value.size()));
    return bytes_of(group) + bytes_of(number) + vr + length + value;
}

std::string us(int value) { return bytes_of(static_cast<std::uint16_t>(value)); }

constexpr const char* kXaClass = "1.2.840.10008.5.1.4.1.1.12.1";

}  // namespace

XaFile::XaFile() {
    set(0x00080016, "UI", kXaClass).set(0x00080018, "UI", "1.2.3.4").set(0x00080060, "CS", "XA");
    set(0x00181110, "DS", "1200").set(0x00181111, "DS", "800").set(0x00181164, "DS", "0.5\\0.4");
    set(0x00181510, "DS", "30").set(0x00181511, "DS", "-20");
    set(0x0020000d, "UI", "1.2.3").set(0x0020000e, "UI", "1.2.3.1");
    set(0x00280004, "CS", "MONOCHROME2").set(0x00281040, "CS", "LIN");
}

XaFile& XaFile::set(std::uint32_t tag, const std::string& vr, const std::string& value) {
    tags[tag] = {vr, value};
    return *this;
}

XaFile& XaFile::erase(std::uint32_t tag) {
    tags.erase(tag);
    return *this;
}

std::string XaFile::bytes() const {
    XaFile all = *this;
    all.set(0x00280002, "US", us(1)).set(0x00280010, "US", us(rows)).set(0x00280011, "US", us(columns));
    all.set(0x00280100, "US", us(16)).set(0x00280101, "US", us(12)).set(0x00280102, "US", us(11));
    all.set(0x00280103, "US", us(0));
    if (frames > 1) all.set(0x00280008, "IS", std::to_string(frames));
    std::vector<std::uint16_t> stored = pixels;
    if (stored.empty()) stored.assign(static_cast<std::size_t>(columns) * rows * frames, 1000);
    const std::string meta = element(0x00020001, "OB", std::string("\0\1", 2)) + element(0x00020002, "UI", kXaClass) +
                             element(0x00020003, "UI", "1.2.3.4") + element(0x00020010, "UI", "1.2.840.10008.1.2.1");
    std::string data;
    for (const auto& [tag, value] : all.tags) data += element(tag, value.first, value.second);
    return std::string(128, '\0') + "DICM" +
           element(0x00020000, "UL", bytes_of(static_cast<std::uint32_t>(meta.size()))) + meta + data +
           element(0x7fe00010, "OW", bytes_of(stored));
}

void write_with_gdcm(const std::filesystem::path& path, const XaFile& file) {
    const auto io = itk::GDCMImageIO::New();
    itk::MetaDataDictionary& dictionary = io->GetMetaDataDictionary();
    for (const auto& [tag, value] : file.tags) {
        char name[16];
        std::snprintf(name, sizeof name, "%04x|%04x", tag >> 16, tag & 0xffff);
        itk::EncapsulateMetaData<std::string>(dictionary, name, value.second);
    }
    io->SetKeepOriginalUID(true);
    io->SetNumberOfDimensions(2);
    io->SetDimensions(0, static_cast<unsigned>(file.columns));
    io->SetDimensions(1, static_cast<unsigned>(file.rows));
    // GDCM writes its spacing over ImagerPixelSpacing: rows first, as DICOM has it.
    const std::string pitch = file.tags.at(0x00181164).second;
    const std::size_t middle = pitch.find('\\');
    io->SetSpacing(0, std::stod(pitch.substr(middle + 1)));
    io->SetSpacing(1, std::stod(pitch.substr(0, middle)));
    io->SetNumberOfComponents(1);
    io->SetPixelType(itk::IOPixelEnum::SCALAR);
    io->SetComponentType(itk::IOComponentEnum::USHORT);
    io->SetFileName(path.string());
    itk::ImageIORegion region(2);
    region.SetSize(0, static_cast<unsigned>(file.columns));
    region.SetSize(1, static_cast<unsigned>(file.rows));
    io->SetIORegion(region);
    io->WriteImageInformation();
    io->Write(file.pixels.data());
}

}  // namespace raylign::detail::test
