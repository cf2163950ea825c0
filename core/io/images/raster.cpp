#include "core/io/images/raster.h"

#include "core/io/files/one_eigen.h"

#include <itkGDCMImageIO.h>
#include <itkImageIOBase.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>

#include "core/base/fault_text.h"
#include "core/io/dicom/dicom_tags.h"
#include "core/io/files/temporary_file.h"
#include "core/io/files/text.h"
#include "core/io/images/quiet_itk.h"
#include "core/io/images/tiff_file.h"
#include "core/io/volumes/nifti_check.h"

namespace raylign::detail {
namespace {

using itk::ImageIOBase;

ImageIOBase::Pointer make_image_io(FileFormat format) {
    switch (format) {
        case FileFormat::nifti:
            return itk::NiftiImageIO::New().GetPointer();
        case FileFormat::meta:
            return itk::MetaImageIO::New().GetPointer();
        case FileFormat::nrrd:
            return itk::NrrdImageIO::New().GetPointer();
        case FileFormat::png:
            return itk::PNGImageIO::New().GetPointer();
        case FileFormat::dicom:
            return itk::GDCMImageIO::New().GetPointer();
        case FileFormat::tiff:
            break;  // not through ITK, see tiff_file.h
    }
    throw Error("no ITK reader for " + format_name(format));
}

template <typename T>
constexpr PixelType integer_type() {
    constexpr bool is_signed = std::numeric_limits<T>::is_signed;
    switch (sizeof(T)) {
        case 1:
            return is_signed ? PixelType::i8 : PixelType::u8;
        case 2:
            return is_signed ? PixelType::i16 : PixelType::u16;
        case 4:
            return is_signed ? PixelType::i32 : PixelType::u32;
        default:
            return is_signed ? PixelType::i64 : PixelType::u64;
    }
}

using Component = itk::IOComponentEnum;

PixelType pixel_type(Component component, const std::filesystem::path& path) {
    switch (component) {
        case Component::UCHAR:
            return PixelType::u8;
        case Component::CHAR:
            return PixelType::i8;
        case Component::USHORT:
            return PixelType::u16;
        case Component::SHORT:
            return PixelType::i16;
        case Component::UINT:
            return PixelType::u32;
        case Component::INT:
            return PixelType::i32;
        case Component::ULONG:
            return integer_type<unsigned long>();
        case Component::LONG:
            return integer_type<long>();
        case Component::ULONGLONG:
            return PixelType::u64;
        case Component::LONGLONG:
            return PixelType::i64;
        case Component::FLOAT:
            return PixelType::f32;
        case Component::DOUBLE:
            return PixelType::f64;
        default:
            break;
    }
    throw bad_value("pixel type", ImageIOBase::GetComponentTypeAsString(component),
                    "integers or floats of 8 to 64 bits", path.string());
}

Component component_of(PixelType type) {
    switch (type) {
        case PixelType::u8:
            return Component::UCHAR;
        case PixelType::i8:
            return Component::CHAR;
        case PixelType::u16:
            return Component::USHORT;
        case PixelType::i16:
            return Component::SHORT;
        case PixelType::u32:
            return Component::UINT;
        case PixelType::i32:
            return Component::INT;
        case PixelType::u64:
            return Component::ULONGLONG;
        case PixelType::i64:
            return Component::LONGLONG;
        case PixelType::f32:
            return Component::FLOAT;
        case PixelType::f64:
            return Component::DOUBLE;
    }
    return Component::UNKNOWNCOMPONENTTYPE;
}

void take_dicom_tags(const ImageIOBase& io, Raster& raster) {
    std::string text;
    const itk::MetaDataDictionary& tags = io.GetMetaDataDictionary();
    const auto number = [&](const char* tag, double otherwise) {
        return itk::ExposeMetaData(tags, tag, text) ? number_from(text).value_or(otherwise) : otherwise;
    };
    raster.bits_stored = static_cast<int>(number("0028|0101", 0));
    if (!itk::ExposeMetaData(tags, "0028|0004", text) || trimmed(text) != "MONOCHROME1") return;
    // GDCMImageIO turns MONOCHROME1 upside down: it stores 2^bits - 1 - pixel, then applies slope and intercept.
    raster.white_is_zero = true;
    raster.inverted_sum =
        number("0028|1053", 1) * (std::ldexp(1.0, raster.bits_stored) - 1) + 2 * number("0028|1052", 0);
}

Raster header_of(const ImageIOBase& io, FileFormat format, const std::filesystem::path& path) {
    Raster raster;
    raster.format = format;
    const unsigned dimensions = io.GetNumberOfDimensions();
    raster.direction.resize(dimensions, dimensions);
    for (unsigned axis = 0; axis < dimensions; ++axis) {
        if (io.GetDimensions(axis) < 1 || io.GetDimensions(axis) > std::numeric_limits<int>::max()) {
            throw bad_value("size along axis " + std::to_string(axis), std::to_string(io.GetDimensions(axis)),
                            "in [1, 2147483647]", path.string());
        }
        raster.size.push_back(static_cast<int>(io.GetDimensions(axis)));
        raster.spacing_mm.push_back(io.GetSpacing(axis));
        raster.origin_mm.push_back(io.GetOrigin(axis));
        for (unsigned row = 0; row < dimensions; ++row) raster.direction(row, axis) = io.GetDirection(axis)[row];
    }
    raster.type = pixel_type(io.GetComponentType(), path);
    raster.components = static_cast<int>(io.GetNumberOfComponents());
    if (format == FileFormat::dicom) take_dicom_tags(io, raster);
    return raster;
}

/// A damaged header may ask for any amount of memory. Packed pixels cannot be 1032 times smaller (deflate's limit);
/// detached headers (.mhd, .nhdr) and DICOM's own compressions are held to the absolute limit only.
void check_bytes(const Raster& raster, const std::filesystem::path& path) {
    constexpr double kLargest = 1e12, kDeflateLimit = 1100;
    double needed = static_cast<double>(bytes_of(raster.type)) * raster.components;
    for (const int n : raster.size) needed *= n;
    const std::string extension = lower_case(path.extension().string());
    const bool is_whole = extension == ".mha" || extension == ".nrrd" || extension == ".png";
    const auto file_bytes = static_cast<double>(std::filesystem::file_size(path));
    if (needed <= (is_whole ? std::min(kLargest, kDeflateLimit * file_bytes) : kLargest)) return;
    throw std::runtime_error("its header states " + size_text(raster.size) + " pixels, " + number_text(needed) +
                             " bytes, and the file has " + number_text(file_bytes));
}

void set_whole_region(ImageIOBase& io) {
    itk::ImageIORegion region(io.GetNumberOfDimensions());
    for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) region.SetSize(axis, io.GetDimensions(axis));
    io.SetIORegion(region);
}

void read_pixels(ImageIOBase& io, const QuietItk& quiet, Raster& raster) {
    raster.bytes.resize(raster.pixel_count() * static_cast<std::size_t>(raster.components) * bytes_of(raster.type));
    set_whole_region(io);
    io.Read(raster.bytes.data());
    // MetaIO reports short and undecodable data on std::cerr only, and goes on.
    if (raster.format == FileFormat::meta && !quiet.text().empty()) throw std::runtime_error(quiet.text());
}

Raster read_with_itk(const std::filesystem::path& path, FileFormat format,
                     const std::function<void(const Raster&)>& check) {
    if (format == FileFormat::nifti) check_nifti(path);
    if (format == FileFormat::dicom) {
        const std::optional<DicomTags> tags = read_dicom_tags(path);
        if (!tags) throw std::runtime_error("DICOM's mark \"DICM\" is missing at byte 128");
        if (!tags->has_pixels) throw std::runtime_error("it has no pixels");
    }
    const ImageIOBase::Pointer io = make_image_io(format);
    const QuietItk quiet;
    const bool is_upper_case = format == FileFormat::meta && path.extension() != lower_case(path.extension().string());
    // MetaImageIO goes by the extension, does not know .MHA and finds a wrong beginning later in any case.
    if (!is_upper_case && !io->CanReadFile(path.c_str())) throw std::runtime_error("it does not begin like one");
    io->SetFileName(path.string());
    io->ReadImageInformation();
    Raster raster = header_of(*io, format, path);
    if (check) check(raster);
    check_bytes(raster, path);
    read_pixels(*io, quiet, raster);
    return raster;
}

void write_with_itk(const std::filesystem::path& path, const Raster& raster) {
    const ImageIOBase::Pointer io = make_image_io(raster.format);
    const QuietItk quiet;
    io->SetNumberOfDimensions(static_cast<unsigned>(raster.size.size()));
    for (unsigned axis = 0; axis < raster.size.size(); ++axis) {
        io->SetDimensions(axis, static_cast<itk::SizeValueType>(raster.size[axis]));
        io->SetSpacing(axis, raster.spacing_mm[axis]);
        io->SetOrigin(axis, raster.origin_mm[axis]);
        std::vector<double> column;
        for (unsigned row = 0; row < raster.size.size(); ++row) column.push_back(raster.direction(row, axis));
        io->SetDirection(axis, column);
    }
    io->SetNumberOfComponents(static_cast<unsigned>(raster.components));
    io->SetPixelType(raster.components == 1 ? itk::IOPixelEnum::SCALAR : itk::IOPixelEnum::RGB);
    io->SetComponentType(component_of(raster.type));
    io->SetFileName(path.string());
    set_whole_region(*io);
    io->WriteImageInformation();
    io->Write(raster.bytes.data());
}

/// Runs `action`; what ITK and the standard library throw becomes an Error that begins with `what`.
template <typename Action>
auto with_errors(const std::string& what, Action&& action) {
    try {
        return action();
    } catch (const itk::ExceptionObject& failure) {
        throw Error(what + ": " + reason_of(failure));
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw Error(what + ": not enough memory for the size its header states");
    } catch (const std::length_error&) {
        throw Error(what + ": not enough memory for the size its header states");
    } catch (const std::exception& failure) {
        throw Error(what + ": " + fault_text(failure));
    }
}

}  // namespace

Raster read_raster_here(const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    check_readable_file(path);
    const std::optional<FileFormat> format = format_of(path);
    if (!format) {
        throw bad_value("format", "unknown", "NIfTI, MHA/MHD, NRRD, TIFF, PNG or DICOM, by its extension",
                        path.string());
    }
    const std::string what =
        path.string() + " cannot be read as " + format_name(*format) + " (truncated, damaged or another format?)";
    return with_errors(what, [&] {
        return *format == FileFormat::tiff ? read_tiff(path, check) : read_with_itk(path, *format, check);
    });
}

void write_raster(const std::filesystem::path& path, const Raster& raster) {
    TemporaryFile temporary(path);
    temporary.reserve(raster.bytes.size());
    const std::string what = path.string() + " cannot be written";
    with_errors(what, [&] {
        if (raster.format == FileFormat::tiff) {
            write_tiff(temporary.path(), raster);
        } else {
            write_with_itk(temporary.path(), raster);
        }
        return 0;
    });
    Raster again;
    try {
        again = read_raster_here(temporary.path());
    } catch (const Error& failure) {
        throw Error(what + ": " + failure.what());
    }
    if (again.bytes != raster.bytes) throw Error(what + ": what reads back differs");
    temporary.commit();
}

}  // namespace raylign::detail
