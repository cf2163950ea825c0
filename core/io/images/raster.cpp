#include "core/io/images/raster.h"

#include "core/io/files/one_eigen.h"

#include <itkImageIOBase.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <utility>

#include "core/base/fault_text.h"
#include "core/io/dicom/dicom_raster.h"
#include "core/io/files/temporary_file.h"
#include "core/io/files/text.h"
#include "core/io/images/headered_file.h"
#include "core/io/images/image_checks.h"
#include "core/io/images/jpeg_file.h"
#include "core/io/images/png_file.h"
#include "core/io/images/quiet_itk.h"
#include "core/io/images/stored_pixels.h"
#include "core/io/images/tiff_file.h"

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
        default:
            break;  // DICOM, TIFF and JPEG: not through ITK
    }
    throw Error("no writer for " + format_name(format));
}

using Component = itk::IOComponentEnum;

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

void set_whole_region(ImageIOBase& io) {
    itk::ImageIORegion region(io.GetNumberOfDimensions());
    for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis) region.SetSize(axis, io.GetDimensions(axis));
    io.SetIORegion(region);
}

Raster read_as(FileFormat format, const std::filesystem::path& path, const std::function<void(const Raster&)>& check) {
    switch (format) {
        case FileFormat::nifti:
        case FileFormat::meta:
        case FileFormat::nrrd:
            return read_headered(path, format, check);
        case FileFormat::tiff:
            return read_tiff(path, check);
        case FileFormat::png:
            return read_png(path, check);
        case FileFormat::jpeg:
            return read_jpeg(path, check);
        case FileFormat::dicom:
            return read_dicom(path, check);
    }
    throw Error(path.string() + ": no reader for " + format_name(format));
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
        throw bad_value("format", "unknown", "NIfTI, MHA/MHD, NRRD, TIFF, PNG, JPEG or DICOM, by its extension",
                        path.string());
    }
    const std::string what =
        path.string() + " cannot be read as " + format_name(*format) + " (truncated, damaged or another format?)";
    return with_errors(what, [&] { return read_as(*format, path, check); });
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
    bool is_same = again.bytes == raster.bytes;
    if (!is_same && raster.components > 1) {  // colours that are grey read back as grey
        Raster grey = raster;
        reduce_to_grey(grey);
        is_same = again.bytes == grey.bytes;
    }
    if (!is_same) throw Error(what + ": what reads back differs");
    temporary.commit();
}

}  // namespace raylign::detail
