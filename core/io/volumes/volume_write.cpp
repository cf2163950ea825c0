#include <cstring>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/images/raster.h"
#include "raylign/io/volume.h"

namespace raylign {
using namespace detail;

void write_volume(const std::filesystem::path& path, const Volume& volume) {
    const std::string name = detail::lower_case(path.filename().string());
    // One file only: .mhd, .nhdr and .hdr would leave the voxels in a second file that no rename covers.
    if (!(name.ends_with(".mha") || name.ends_with(".nrrd") || name.ends_with(".nii") || name.ends_with(".nii.gz"))) {
        throw bad_value("volume format", path.extension().string(), ".mha, .nrrd, .nii or .nii.gz", path.string());
    }
    detail::Raster raster;
    raster.format = detail::format_of(path).value();
    for (int axis = 0; axis < 3; ++axis) {
        raster.size.push_back(volume.grid.size[axis]);
        raster.spacing_mm.push_back(volume.grid.spacing_mm[axis]);
        raster.origin_mm.push_back(volume.grid.origin_mm[axis]);
    }
    raster.direction = volume.grid.direction;
    raster.type = detail::PixelType::f32;
    raster.bytes.resize(volume.attenuation_per_mm.size() * sizeof(float));
    std::memcpy(raster.bytes.data(), volume.attenuation_per_mm.data(), raster.bytes.size());
    detail::write_raster(path, raster);
}

}  // namespace raylign
