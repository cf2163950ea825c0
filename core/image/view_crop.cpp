#include "core/image/view_crop.h"

#include <cmath>
#include <string>

#include "core/base/error.h"

namespace raylign::detail {
Image crop(const Image& image, const PixelBox& box) {
    if (image.empty()) return {};
    Image cut(box.end.x() - box.begin.x(), box.end.y() - box.begin.y());
    for (int y = 0; y < cut.height; ++y) {
        for (int x = 0; x < cut.width; ++x) cut(x, y) = image(box.begin.x() + x, box.begin.y() + y);
    }
    return cut;
}

View crop(const View& view, const PixelBox& box) {
    const Eigen::Vector2i& size = view.geometry.camera.size_px;
    if (box.begin.minCoeff() < 0 || (box.end - box.begin).minCoeff() < 1 || (size - box.end).minCoeff() < 0) {
        throw bad_value("pixels to keep",
                        std::to_string(box.begin.x()) + " " + std::to_string(box.begin.y()) + " to " +
                            std::to_string(box.end.x()) + " " + std::to_string(box.end.y()),
                        "inside " + std::to_string(size.x()) + " x " + std::to_string(size.y()), "view " + view.name);
    }
    View cut = view;
    cut.image = crop(view.image, box);
    cut.weights = crop(view.weights, box);
    cut.geometry.camera.size_px = box.end - box.begin;
    cut.geometry.camera.intrinsics_px.col(2).head<2>() -= box.begin.cast<double>();
    return cut;
}

PixelBox reached_pixels(const ViewGeometry& view, const VoxelGrid& grid, const RigidTransform& world_from_ct,
                        int margin_px) {
    const Eigen::Vector2i& size = view.camera.size_px;
    const PixelBox whole{Eigen::Vector2i::Zero(), size};
    Eigen::Array2d low = Eigen::Array2d::Constant(1e9), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Array3d side(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
        // The field ends a voxel further out.
        const Eigen::Vector3d voxel = side * (grid.size.cast<double>().array() + 1) - 1;
        const Eigen::Vector2d pixel = project(view, world_from_ct * grid.ct_from_voxel(voxel));
        if (!pixel.allFinite()) return whole;
        low = low.min(pixel.array());
        high = high.max(pixel.array());
    }
    const Eigen::Array2d last = size.cast<double>().array();
    const PixelBox box{(low - margin_px).floor().max(0.0).min(last).cast<int>().matrix(),
                       (high + margin_px + 1).ceil().max(0.0).min(last).cast<int>().matrix()};
    return (box.end - box.begin).minCoeff() < 1 ? whole : box;
}

}  // namespace raylign::detail
