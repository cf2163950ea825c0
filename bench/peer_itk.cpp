#include <itkImage.h>
#include <itkMultiThreaderBase.h>
#include <itkRayCastInterpolateImageFunction.h>
#include <itkResampleImageFilter.h>
#include <itkTranslationTransform.h>

#include <chrono>

#include "bench/peers.h"
#include "core/base/error.h"

namespace raylign::detail::bench {
namespace {

using ItkImage = itk::Image<float, 3>;
using Interpolator = itk::RayCastInterpolateImageFunction<ItkImage, double>;
using Resample = itk::ResampleImageFilter<ItkImage, ItkImage, double>;
using Still = itk::TranslationTransform<double, 3>;

ItkImage::PointType point(const Eigen::Vector3d& x) { return ItkImage::PointType(x.data()); }

/// Borrows the voxels.
ItkImage::Pointer itk_image(const Volume& volume) {
    const auto image = ItkImage::New();
    ItkImage::SizeType size;
    for (unsigned i = 0; i < 3; ++i) size[i] = static_cast<itk::SizeValueType>(volume.grid.size[i]);
    image->SetRegions(ItkImage::RegionType(size));
    image->SetSpacing(ItkImage::SpacingType(volume.grid.spacing_mm.data()));
    image->SetOrigin(point(volume.grid.origin_mm));
    image->GetPixelContainer()->SetImportPointer(const_cast<float*>(volume.attenuation_per_mm.data()),
                                                 volume.attenuation_per_mm.size(), false);
    return image;
}

/// The detector as a 3-D image of one slice, where it stands in ct.
void place_detector(Resample& filter, const ViewGeometry& view, const RigidTransform& ct_from_camera) {
    const Camera& camera = view.camera;
    const Eigen::Vector2d pitch_mm = *camera.pixel_pitch_mm();
    const Eigen::Vector3d first_pixel = ct_from_camera * (*camera.sdd_mm * camera.intrinsics_px.inverse().col(2));
    const double spacing[3] = {pitch_mm.x(), pitch_mm.y(), 1};
    ItkImage::DirectionType direction;
    for (unsigned row = 0; row < 3; ++row) {
        for (unsigned column = 0; column < 3; ++column) {
            direction[row][column] = ct_from_camera.rotation(row, column);
        }
    }
    ItkImage::SizeType size;
    size[0] = static_cast<itk::SizeValueType>(camera.size_px.x());
    size[1] = static_cast<itk::SizeValueType>(camera.size_px.y());
    size[2] = 1;
    filter.SetSize(size);
    filter.SetOutputSpacing(ItkImage::SpacingType(spacing));
    filter.SetOutputOrigin(point(first_pixel));
    filter.SetOutputDirection(direction);
}

TimedImage render(Resample& filter, Interpolator& interpolator, const ViewGeometry& view,
                  const RigidTransform& world_from_ct) {
    const RigidTransform ct_from_camera = inverse(view.camera_from_world * world_from_ct);
    interpolator.SetFocalPoint(point(ct_from_camera.translation_mm));
    place_detector(filter, view, ct_from_camera);
    filter.Modified();
    const auto start = std::chrono::steady_clock::now();
    filter.Update();
    TimedImage result{Image(view.camera.size_px.x(), view.camera.size_px.y()),
                      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
    const float* pixels = filter.GetOutput()->GetBufferPointer();
    result.image.pixels.assign(pixels, pixels + result.image.pixels.size());
    return result;
}

}  // namespace

Peer itk_peer(const Volume& volume, int threads) {
    if (!volume.grid.direction.isIdentity()) throw Error("the ITK peer knows no direction but the identity");
    const auto thread_count = static_cast<itk::ThreadIdType>(threads);
    itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(thread_count);
    const auto still = Still::New();
    const auto interpolator = Interpolator::New();
    interpolator->SetTransform(still);
    interpolator->SetThreshold(0);
    const auto filter = Resample::New();
    filter->SetInput(itk_image(volume));
    filter->SetInterpolator(interpolator);
    filter->SetTransform(still);
    filter->SetDefaultPixelValue(0);
    return {"ITK ray cast", [filter, interpolator](const ViewGeometry& view, const RigidTransform& world_from_ct) {
                return render(*filter, *interpolator, view, world_from_ct);
            }};
}

}  // namespace raylign::detail::bench
