#include "core/io/geometry/rt_image.h"

#include <array>
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

constexpr Tag kEccentric{0x300a0125, "TableTopEccentricAngle (300A,0125)"};
constexpr Tag kPitchAngle{0x300a0140, "TableTopPitchAngle (300A,0140)"};
constexpr Tag kRollAngle{0x300a0144, "TableTopRollAngle (300A,0144)"};
constexpr Tag kGantryPitch{0x300a014a, "GantryPitchAngle (300A,014A)"};
constexpr Tag kImagePlane{0x3002000c, "RTImagePlane (3002,000C)"};
constexpr Tag kPatientPosition{0x00185100, "PatientPosition (0018,5100)"};

class RtReader {
public:
    RtReader(const DicomTags& tags, std::string where) : tags_(tags), where_(std::move(where)) {}

    [[nodiscard]] std::vector<double> need(const Tag& tag, std::size_t count) const {
        std::vector<double> numbers = tags_.numbers(tag.id, count);
        if (!numbers.empty()) return numbers;
        if (tags_.text(tag.id).empty()) throw Error(std::string(tag.name) + " is missing in " + where_);
        throw bad_value(tag.name, tags_.text(tag.id), std::to_string(count) + " finite numbers", where_);
    }

    /// In degrees; 0 where the tag is absent or empty.
    [[nodiscard]] double angle_deg(const Tag& tag) const { return tags_.text(tag.id).empty() ? 0 : need(tag, 1)[0]; }

    void check_plane() const {
        const std::string plane = tags_.text(kImagePlane.id);
        if (!plane.empty() && plane != "NORMAL") throw bad_value(kImagePlane.name, plane, "NORMAL", where_);
        if (std::remainder(angle_deg(kGantryPitch), 360) != 0) {
            throw bad_value(kGantryPitch.name, number_text(angle_deg(kGantryPitch)) + " degrees",
                            "0 (others are not read)", where_);
        }
    }

    /// IEC 61217 fixed axes (x to the right seen from the couch's end, y to the gantry, z up) from the patient's LPS,
    /// the couch at 0.
    [[nodiscard]] Eigen::Matrix3d fixed_from_patient() const {
        struct Position {
            const char* name;
            std::array<double, 9> rows;
        };
        constexpr std::array<Position, 8> kPositions = {{{"HFS", {1, 0, 0, 0, 0, 1, 0, -1, 0}},
                                                         {"HFP", {-1, 0, 0, 0, 0, 1, 0, 1, 0}},
                                                         {"HFDR", {0, 1, 0, 0, 0, 1, 1, 0, 0}},
                                                         {"HFDL", {0, -1, 0, 0, 0, 1, -1, 0, 0}},
                                                         {"FFS", {-1, 0, 0, 0, 0, -1, 0, -1, 0}},
                                                         {"FFP", {1, 0, 0, 0, 0, -1, 0, 1, 0}},
                                                         {"FFDR", {0, -1, 0, 0, 0, -1, 1, 0, 0}},
                                                         {"FFDL", {0, 1, 0, 0, 0, -1, -1, 0, 0}}}};
        const std::string stated = tags_.text(kPatientPosition.id);
        for (const Position& position : kPositions) {
            if (stated != position.name && !(stated.empty() && &position == &kPositions.front())) continue;
            return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(position.rows.data());
        }
        throw bad_value(kPatientPosition.name, stated, "HFS, HFP, HFDR, HFDL, FFS, FFP, FFDR or FFDL", where_);
    }

private:
    const DicomTags& tags_;
    std::string where_;
};

/// Rotates about a coordinate axis, right-handed.
Eigen::Matrix3d turn_deg(double angle_deg, int axis) {
    const double angle = angle_deg * std::numbers::pi / 180;
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    rotation(a, a) = rotation(b, b) = std::cos(angle);
    rotation(b, a) = std::sin(angle);
    rotation(a, b) = -std::sin(angle);
    return rotation;
}

/// Fixed axes from those of the table top: the turntable about the vertical, then the table top's own turn, pitch and
/// roll (IEC 61217). Where it turns about does not matter, as the isocentre is known in the patient.
Eigen::Matrix3d fixed_from_table(const RtReader& reader) {
    return turn_deg(reader.angle_deg(kCouch) + reader.angle_deg(kEccentric), 2) *
           turn_deg(reader.angle_deg(kPitchAngle), 0) * turn_deg(reader.angle_deg(kRollAngle), 1);
}

/// K of the stored pixels in a camera with x = gantry x, y = -gantry y:
///   pixel_i = axis_i . (R(receptor angle)^T (point - receptor origin) - first pixel) / spacing.
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
    const Eigen::Matrix2d gantry_from_receptor = turn_deg(reader.angle_deg(kReceptorAngle), 2).topLeftCorner<2, 2>();
    Eigen::Vector2d first = gantry_from_receptor * Eigen::Vector2d(position[0], position[1]);
    if (const std::vector<double> stated = tags.numbers(kTranslation.id, 3); !stated.empty()) {
        first += Eigen::Vector2d(stated[0], stated[1]);
    }
    const Eigen::Matrix2d axes_gantry = axes * gantry_from_receptor.transpose();
    Eigen::Matrix3d intrinsics = Eigen::Matrix3d::Identity();
    for (int i = 0; i < 2; ++i) {
        const double pitch = spacing[i == 0 ? 1 : 0];  // DICOM gives the distance of rows first
        intrinsics(i, 0) = axes_gantry(i, 0) * sdd_mm / pitch;
        intrinsics(i, 1) = -axes_gantry(i, 1) * sdd_mm / pitch;
        intrinsics(i, 2) = -axes_gantry.row(i).dot(first) / pitch;
    }
    return intrinsics;
}

/// What was taken for granted, and the angles that were used.
std::vector<std::string> rt_assumptions(const DicomTags& tags, const RtReader& reader) {
    const std::string position = tags.text(kPatientPosition.id);
    std::vector<std::string> notes = {
        "DICOM RT Image: the world's origin is the isocentre, its axes are the patient's LPS (PatientPosition " +
        (position.empty() ? "is missing: HFS" : position) + "); RTImagePosition is the centre of the first pixel"};
    std::string angles;
    for (const Tag& tag : {kCouch, kEccentric, kPitchAngle, kRollAngle, kReceptorAngle}) {
        const double angle = reader.angle_deg(tag);
        if (angle != 0) angles += (angles.empty() ? "" : ", ") + std::string(tag.name) + " = " + number_text(angle);
    }
    if (!angles.empty()) notes.push_back("turned by " + angles + " degrees (IEC 61217)");
    return notes;
}

}  // namespace

GeometryView read_rt_image(const DicomTags& tags, const GeometryHints& hints, const std::string& name,
                           const std::string& where) {
    const RtReader reader(tags, where);
    reader.check_plane();
    const double sad = hints.sad_mm ? *hints.sad_mm : reader.need(kSad, 1)[0];
    const double sdd = hints.sdd_mm ? *hints.sdd_mm : reader.need(kSdd, 1)[0];
    if (!(sad > 0) || !(sdd > 0)) throw Error(where + ": distances of source, axis and image must be positive");
    StoredProjection stored;
    stored.size_px = settled_size(
        Eigen::Vector2i(static_cast<int>(tags.number(kColumnsTag, 0)), static_cast<int>(tags.number(kRowsTag, 0))),
        hints, where);
    stored.sdd_mm = sdd;
    Eigen::Matrix3d camera_from_gantry;
    camera_from_gantry << 1, 0, 0, 0, -1, 0, 0, 0, -1;  // rows away from the gantry, rays down from the source
    const Eigen::Matrix3d gantry_from_fixed = turn_deg(reader.need(kGantry, 1)[0], 1).transpose();
    stored.pixel_from_world = projection_of(
        stored_intrinsics(tags, reader, sdd, where),
        camera_from_gantry * gantry_from_fixed * fixed_from_table(reader) * reader.fixed_from_patient(), {0, 0, sad});
    stored.assumptions = rt_assumptions(tags, reader);
    GeometryView view = finish_view(std::move(stored), hints, name, where);
    view.is_dicom = true;
    view.frame = 1;
    if (const std::vector<double> iso = tags.numbers(kIsocentre.id, 3); !iso.empty()) {
        view.isocentre_ct_mm = Eigen::Vector3d(iso[0], iso[1], iso[2]);
    }
    return view;
}

}  // namespace raylign::detail
