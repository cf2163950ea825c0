#include "core/io/images/headered_file.h"

#include <utility>

#include "core/io/images/meta_file.h"
#include "core/io/images/nifti_file.h"
#include "core/io/images/nrrd_file.h"
#include "core/io/images/stored_pixels.h"

namespace raylign::detail {

Raster read_headered(const std::filesystem::path& path, FileFormat format,
                     const std::function<void(const Raster&)>& check) {
    const auto read = format == FileFormat::nifti ? read_nifti : format == FileFormat::meta ? read_meta : read_nrrd;
    HeaderedRaster file = read(path);
    if (check) check(file.raster);
    check_stored(file, path);
    read_stored(file, path);
    return std::move(file.raster);
}

}  // namespace raylign::detail
