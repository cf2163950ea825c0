#include "core/io/geometry/rt_image.h"

#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign::detail {
namespace {

struct Tag {
    std::uint32_t id;
    const char* name;
};
constexpr Tag kSpacing{0x30020011, "ImagePlanePixelSpacing (3002,0011)"};
constexpr Tag kPosition{0x30020012, "RTImagePosition (3002,0012)"};
constexpr Tag kOrientation{0x30020010, "RTImageOrientation (3002,0010)"};
constexpr Tag kTranslation{0x3002000d, "XRayImageReceptorTranslation (3002,000D)"};
constexpr Tag kReceptorAngle{0x3002000e, "XRayImageReceptorAngle (3002,000E)"};
constexpr Tag kSad{0x30020022, "RadiationMachineSAD (3002,0022)"};
constexpr Tag kSdd{0x30020026, "RTImageSID (3002,0026)"};
constexpr Tag kGantry{0x300a011e, "GantryAngle (300A,011E)"};
constexpr Tag kCouch{0x300a0122, "PatientSupportAngle (300A,0122)"};
constexpr Tag kIsocentre{0x300a012c, "IsocenterPosition (300A,012C)"};

class RtReader {
public:
    RtReader(const DicomTags& tags, std::string where) : tags_(tags), where_(std::move(where)) {}

    [[nodiscard]] std::vector<double> need(const Tag& tag, std::size_t count) const {
        std::vector<double> numbers = tags_.numbers(tag.id, count);
        if (!numbers.empty()) return numbers;
        if (tags_.text(tag.id).empty()) throw Error(std::string(tag.name) + " is missing in " + where_);
        throw bad_value(tag.name, tags_.text(tag.id), std::to_string(count) + " finite numbers", where_);
    }

    void need_zero(const Tag& tag) const {
        const double value = tags_.number(tag.id, 0);
        if (std::remainder(value, 360) != 0) {
            throw bad_value(tag.name, number_text(value) + " degrees", "0 (others are not read)", where_);
        }
    }

private:
    const DicomTags& tags_;
    std::string where_;
};

/// K of the stored pixels in a camera with x = receptor x, y = -receptor y:
///   pixel_i = axis_i . (point - first pixel) / spacing.
Eigen::Matrix3d stored_intrinsics(const DicomTags& tags, const RtReader& reader, double sdd_mm,
                                  const std::string& where) {
    const std::vector<double> spacing = reader.need(kSpacing, 2), position = reader.need(kPosition, 2);
    if (!(spacing[0] > 0 && spacing[1] > 0)) throw bad_value(kSpacing.name, "not positive", "positive", where);
    Eigen::Matrix2d axes{{1, 0}, {0, -1}};  // columns, rows along the receptor's x, y
    if (const std::vector<double> stated = tags.numbers(kOrientation.id, 6); !stated.empty()) {
        axes << stated[0], stated[1], stated[3], stated[4];
    }
    if (!(axes * axes.transpose()).isIdentity(1e-4)) {
        throw bad_value(kOrientation.name, tags.text(kOrientation.id), "two directions in the receptor's plane", where);
    }
    Eigen::Vector2d first(position[0], position[1]);
    if (const std::vector<double> stated = tags.numbers(kTranslation.id, 3); !stated.empty()) {
        first += Eigen::Vector2d(stated[0], stated[1]);
    }
    Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
    for (int i = 0; i < 2; ++i) {
        const double pitch = spacing[i == 0 ? 1 : 0];  // DICOM gives the distance of rows first
        intrinsics(i, 0) = axes(i, 0) * sdd_mm / pitch;
        intrinsics(i, 1) = -axes(i, 1) * sdd_mm / pitch;
        intrinsics(i, 2) = -axes.row(i).dot(first) / pitch;
    }
    return intrinsics;
}

}  // namespace

GeometryView read_rt_image(const DicomTags& tags, const GeometryHints& hints, const std::string& name,
                           const std::string& where) {
    const RtReader reader(tags, where);
    reader.need_zero(kCouch);
    reader.need_zero(kReceptorAngle);
    const double sad = hints.sad_mm ? *hints.sad_mm : reader.need(kSad, 1)[0];
    const double sdd = hints.sdd_mm ? *hints.sdd_mm : reader.need(kSdd, 1)[0];
    if (!(sad > 0) || !(sdd > 0)) throw Error(where + ": distances of source, axis and image must be positive");
    const double gantry = reader.need(kGantry, 1)[0] * std::numbers::pi / 180;
    StoredProjection stored;
    stored.size_px = settled_size(
        Eigen::Vector2i(static_cast<int>(tags.number(kColumnsTag, 0)), static_cast<int>(tags.number(kRowsTag, 0))),
        hints, where);
    stored.sdd_mm = sdd;
    Eigen::Matrix3d base, turn;
    base << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // gantry 0: columns to the left, rows to the feet, rays to the back
    turn << std::cos(gantry), -std::sin(gantry), 0, std::sin(gantry), std::cos(gantry), 0, 0, 0, 1;
    stored.pixel_from_world =
        projection_of(stored_intrinsics(tags, reader, sdd, where), base * turn.transpose(), {0, 0, sad});
    stored.assumptions = {
        "DICOM RT Image: the world's origin is the isocentre, its axes are LPS of a patient supine, "
        "head first; RTImagePosition is the centre of the first pixel"};
    GeometryView view = finish_view(std::move(stored), hints, name, where);
    view.is_dicom = true;
    view.frame = 1;
    if (const std::vector<double> iso = tags.numbers(kIsocentre.id, 3); !iso.empty()) {
        view.isocentre_ct_mm = Eigen::Vector3d(iso[0], iso[1], iso[2]);
    }
    return view;
}

}  // namespace raylign::detail
