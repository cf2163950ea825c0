#include <array>
#include <cmath>

#include "core/base/error.h"
#include "core/io/dicom/dicom_file.h"
#include "core/io/dicom/functional_groups.h"
#include "core/io/dicom/modality.h"
#include "core/io/dicom/pixel_layout.h"
#include "core/io/files/text.h"
#include "core/io/geometry/dicom_orientation.h"
#include "core/io/geometry/dicom_xray_tags.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/rt_image.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign::detail {
namespace {

using namespace xray;  // NOLINT: the tags are this file's vocabulary

/// What the tags and hints say, in the program's words.
struct DicomXray {
    CArm c_arm;
    bool has_field_tags = false;  ///< rotation or flip of the stored field is stated
    StoredOrientation orientation;
    std::vector<std::string> assumptions;
};

class XrayReader {
public:
    /// `tags`: of the frame, from 1.
    XrayReader(const DicomTags& tags, int frame, const GeometryHints& hints, std::string where)
        : tags_(tags), hints_(hints), where_(std::move(where)), frame_(frame) {
        frames_ = std::max(1, static_cast<int>(tags_.number(kFrames.id, 1)));
    }

    DicomXray read() {
        read_size();
        read_pitch();
        read_distances();
        read_angles();
        read_orientation();
        read_principal_point();
        return std::move(xray_);
    }

private:
    void note(const std::string& text) { xray_.assumptions.push_back(text); }

    [[nodiscard]] Error missing(const Tag& tag, const std::string& remedy) const {
        return Error(std::string(tag.name) + " is missing in " + where_ + ": " + remedy);
    }

    /// One number of a tag; empty where the tag is absent or empty. Throws Error for anything else.
    [[nodiscard]] std::optional<double> number(const Tag& tag) const {
        if (tags_.text(tag.id).empty()) return std::nullopt;
        const std::vector<double> numbers = tags_.numbers(tag.id, 1);
        if (numbers.empty()) throw bad_value(tag.name, tags_.text(tag.id), "one finite number", where_);
        return numbers[0];
    }

    [[nodiscard]] std::optional<double> positive(const Tag& tag) const {
        const std::optional<double> value = number(tag);
        if (value && *value == 0) return std::nullopt;  // how some writers say "unknown"
        if (value && !(*value > 0)) throw bad_value(tag.name, number_text(*value), "positive", where_);
        return value;
    }

    /// The tag's value or the hint's; they must not contradict each other.
    [[nodiscard]] std::optional<double> settled(const Tag& tag, std::optional<double> stated,
                                                const std::optional<double>& hint, const char* hint_name) {
        if (stated && hint && std::abs(*stated - *hint) > 1e-3 * std::abs(*stated)) {
            note(std::string(tag.name) + " = " + number_text(*stated) + " is overruled by " + hint_name + " = " +
                 number_text(*hint));
        }
        return hint ? hint : stated;
    }

    void read_size() {
        const double columns = tags_.number(kColumns.id, 0), rows = tags_.number(kRows.id, 0);
        if (!(columns >= 1 && rows >= 1)) throw missing(columns >= 1 ? kRows : kColumns, "it is no image");
        xray_.c_arm.size_px =
            settled_size(Eigen::Vector2i(static_cast<int>(columns), static_cast<int>(rows)), hints_, where_);
    }

    void read_pitch() {
        const std::vector<double> pitch = tags_.numbers(kPitch.id, 2);
        if (hints_.pixel_pitch_mm) {
            xray_.c_arm.pixel_pitch_mm = *hints_.pixel_pitch_mm;
        } else if (pitch.empty()) {
            throw missing(kPitch,
                          "give pixel_pitch_mm, measured at the detector (PixelSpacing (0028,0030) may be "
                          "calibrated elsewhere)");
        } else {
            xray_.c_arm.pixel_pitch_mm = {pitch[1], pitch[0]};  // DICOM gives the distance of rows first
        }
        if (!(xray_.c_arm.pixel_pitch_mm.minCoeff() > 0)) {
            throw bad_value(kPitch.name, tags_.text(kPitch.id), "two positive numbers", where_);
        }
    }

    void read_distances() {
        const std::optional<double> sdd = settled(kSdd, positive(kSdd), hints_.sdd_mm, "sdd_mm");
        if (!sdd) throw missing(kSdd, "give sdd_mm");
        std::optional<double> stated = positive(kSid);
        if (!stated) stated = positive(kSpd);
        const std::optional<double> magnification = positive(kMagnification);
        if (stated && magnification && std::abs(*sdd / *stated / *magnification - 1) > 0.02) {
            throw Error(std::string(kMagnification.name) + " = " + number_text(*magnification) + " in " + where_ +
                        " contradicts the distances: " + number_text(*sdd) + " / " + number_text(*stated) + " = " +
                        number_text(*sdd / *stated));
        }
        if (!stated && magnification && !hints_.sad_mm) {
            stated = *sdd / *magnification;
            note("the isocentre's distance from the source, " + number_text(*stated) + " mm, follows from " +
                 kMagnification.name);
        }
        const std::optional<double> sad = settled(kSpd, stated, hints_.sad_mm, "sad_mm");
        if (!sad) throw missing(kSpd, "give sad_mm");
        if (!(*sdd > *sad)) {
            throw Error(std::string(kSdd.name) + " = " + number_text(*sdd) + " mm in " + where_ + " contradicts " +
                        kSpd.name + " = " + number_text(*sad) + " mm: the detector must be behind the patient");
        }
        if (!positive(kSid) && !hints_.sad_mm && positive(kSpd)) {
            note(std::string(kSpd.name) + " is taken as the distance of source and isocentre");
        }
        xray_.c_arm.sdd_mm = *sdd;
        xray_.c_arm.sad_mm = *sad;
    }

    /// An angle with its increment in this frame, in the range that DICOM allows.
    double angle(const Tag& tag, const Tag& increment, const std::optional<double>& hint, double limit_deg) const {
        std::optional<double> value = hint ? hint : number(tag);
        if (!value) value = angle_of_view_position(tag);
        if (!value) throw missing(tag, "give primary_angle_deg and secondary_angle_deg");
        const std::vector<double> increments = tags_.all_numbers(increment.id);
        if (!hint && static_cast<int>(increments.size()) == frames_) {
            *value += increments[static_cast<std::size_t>(frame_ - 1)];
        } else if (!hint && !increments.empty()) {
            throw bad_value(increment.name, std::to_string(increments.size()) + " numbers",
                            "as many as frames, " + std::to_string(frames_), where_);
        }
        if (!(std::abs(*value) <= limit_deg)) {
            throw bad_value(tag.name, number_text(*value) + " degrees",
                            "in [-" + number_text(limit_deg) + ", " + number_text(limit_deg) + "]", where_);
        }
        return *value;
    }

    /// Where a DX detector stands: its view position names the way of the rays (AP) or the side at the detector (LL).
    [[nodiscard]] std::optional<double> angle_of_view_position(const Tag& tag) const {
        const std::string position = tags_.text(kViewPosition.id);
        constexpr std::array<std::pair<const char*, double>, 4> kPrimaryOf = {
            {{"PA", 0}, {"AP", 180}, {"LL", 90}, {"RL", -90}}};
        for (const auto& [name, primary_deg] : kPrimaryOf) {
            if (position == name) return tag.id == kPrimary.id ? primary_deg : 0;
        }
        return std::nullopt;
    }

    void read_angles() {
        if (frames_ > 1) note("frame " + std::to_string(frame_) + " of " + std::to_string(frames_));
        xray_.c_arm.primary_angle_deg = angle(kPrimary, kPrimaryIncrement, hints_.primary_angle_deg, 180);
        xray_.c_arm.secondary_angle_deg = angle(kSecondary, kSecondaryIncrement, hints_.secondary_angle_deg, 90);
        if (!hints_.primary_angle_deg && !number(kPrimary)) {
            note(std::string(kPrimary.name) + " is missing: " + kViewPosition.name + " = " +
                 tags_.text(kViewPosition.id) + " is taken for it");
        }
        note(
            "the world's origin is the isocentre, its axes are the patient's LPS; the central ray hits the detector's "
            "middle at a right angle");
    }

    void read_orientation() {
        const std::string rotation = tags_.text(kFieldRotation.id), flip = tags_.text(kFieldFlip.id);
        xray_.has_field_tags = !rotation.empty() || !flip.empty();
        const double rotation_deg = number(kFieldRotation).value_or(0);
        if (std::remainder(rotation_deg, 90) != 0)
            throw bad_value(kFieldRotation.name, rotation, "0, 90, 180 or 270", where_);
        if (!flip.empty() && flip != "YES" && flip != "NO") throw bad_value(kFieldFlip.name, flip, "YES or NO", where_);
        const StoredOrientation by_tags = orientation_of_field(rotation_deg, flip == "YES");
        const PatientLabels labels = patient_labels(tags_.text(kPatientOrientation.id), where_);
        const Eigen::Matrix3d world_from_camera = view_from_c_arm(xray_.c_arm).camera_from_world.rotation.transpose();
        xray_.orientation = by_tags;
        if (!labels.is_given) {
            note(xray_.has_field_tags
                     ? "columns and rows by FieldOfViewRotation and FieldOfViewHorizontalFlip, from an "
                       "image as an observer at the detector sees the patient"
                     : "no tag says how the image is turned: it is taken as an observer at the "
                       "detector sees the patient (at 0/0 the patient's left on the right side)");
        } else if (xray_.has_field_tags) {
            check_labels(labels, by_tags, world_from_camera);
        } else {
            xray_.orientation = orientation_of_labels(labels, world_from_camera, where_);
            note("columns and rows by " + std::string(kPatientOrientation.name) + " = " +
                 tags_.text(kPatientOrientation.id));
        }
    }

    /// Two statements about one thing. Where only a mirror lies between them it can be offered; nothing is mended.
    void check_labels(const PatientLabels& labels, const StoredOrientation& by_tags,
                      const Eigen::Matrix3d& world_from_camera) {
        if (agrees(labels, by_tags, world_from_camera) || hints_.flip) return;
        const StoredOrientation mirrored{-by_tags.column_camera, by_tags.row_camera};
        const std::string what = std::string(kPatientOrientation.name) + " = " + tags_.text(kPatientOrientation.id) +
                                 " in " + where_ + " contradicts the angles and the field-of-view tags: ";
        if (agrees(labels, mirrored, world_from_camera)) {
            throw Error(what + "the image is mirrored. Give \"flip\": \"" +
                        (by_tags.is_mirrored() ? "none\"" : "columns\"") +
                        " to follow the orientation, or \"flip\": \"" +
                        (by_tags.is_mirrored() ? "columns\"" : "none\"") + " to follow the tags");
        }
        throw Error(what + "the image is turned. Mend the tags, or give a c_arm with camera_from_world instead");
    }

    /// The pixel that the central ray hits. DICOM says where the field of view lies on the detector (in elements, row
    /// first), before it is rotated and flipped.
    void read_principal_point() {
        const Eigen::Vector2d middle = (xray_.c_arm.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
        xray_.c_arm.principal_point_px = middle;
        const std::vector<double> field = tags_.numbers(kFieldOrigin.id, 2);
        const std::vector<double> active = tags_.numbers(kActiveOrigin.id, 2);
        const std::vector<double> dimensions = tags_.numbers(kActiveDimensions.id, 2);
        const std::vector<double> element = tags_.numbers(kElementSpacing.id, 2);
        if (field.empty()) return;
        if (dimensions.empty() || element.empty()) {
            note(std::string(kFieldOrigin.name) + " is not used, as " +
                 (dimensions.empty() ? kActiveDimensions.name : kElementSpacing.name) + " is missing");
            return;
        }
        const auto pair = [](const std::vector<double>& v) { return Eigen::Vector2d(v[1], v[0]); };
        const Eigen::Vector2d origin = active.empty() ? Eigen::Vector2d::Zero() : pair(active);
        const Eigen::Vector2d element_mm = pair(element);
        if (!(element_mm.minCoeff() > 0)) throw bad_value(kElementSpacing.name, "not positive", "positive", where_);
        // Middle of the active area from the field's top left corner, along the detector's columns and rows [mm].
        const Eigen::Vector2d corner_mm = (origin - pair(field)).cwiseProduct(element_mm) + pair(dimensions) / 2;
        xray_.c_arm.principal_point_px =
            middle + stored_offset_px(corner_mm, xray_.orientation, xray_.c_arm.size_px, xray_.c_arm.pixel_pitch_mm);
        note("the central ray hits the middle of the active detector area, pixel (" +
             number_text(xray_.c_arm.principal_point_px->x()) + ", " +
             number_text(xray_.c_arm.principal_point_px->y()) + ") as stored");
    }

    const DicomTags& tags_;
    const GeometryHints& hints_;
    std::string where_;
    DicomXray xray_;
    int frame_ = 1, frames_ = 1;
};

/// The frame that the hints ask for, from 1.
int checked_frame(const DicomFile& file, const GeometryHints& hints) {
    const int frames = file.tags.has_pixels ? pixel_layout(file).frames : 1;
    if (hints.item < 0 || hints.item > frames) {
        throw bad_value("frame", std::to_string(hints.item), "in [1, " + std::to_string(frames) + "]", file.name);
    }
    return std::max(1, hints.item);
}

}  // namespace

std::vector<GeometryView> read_dicom_geometry(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    refuse_hint(hints.detector_origin_mm.has_value(), "detector_origin_mm", "DICOM", where);
    refuse_hint(hints.unit_mm.has_value(), "unit_mm", "DICOM", where);
    const DicomFile file = open_dicom(path);
    check_is_xray(file.tags, where);
    const int frame = checked_frame(file, hints);
    const DicomTags tags = tags_of_frame(file.tags, frame - 1, where);
    if (sop_class_of(tags) == kRtImage) return {read_rt_image(tags, hints, path.stem().string(), where)};
    DicomXray xray = XrayReader(tags, frame, hints, where).read();
    const ViewGeometry arm = view_from_c_arm(xray.c_arm);
    StoredProjection stored;
    stored.size_px = xray.c_arm.size_px;
    stored.sdd_mm = xray.c_arm.sdd_mm;
    // pixel = principal point + (axis . (x, y)) sdd / (z pitch), with the stored image's axes in camera coordinates.
    Eigen::Matrix3d intrinsics = arm.camera.intrinsics_px;
    intrinsics.topLeftCorner<2, 2>().setZero();
    for (int axis = 0; axis < 2; ++axis) {
        const Eigen::Vector2d& along = axis == 0 ? xray.orientation.column_camera : xray.orientation.row_camera;
        intrinsics.block<1, 2>(axis, 0) = along.transpose() * stored.sdd_mm.value() / xray.c_arm.pixel_pitch_mm[axis];
    }
    stored.pixel_from_world =
        projection_of(intrinsics, arm.camera_from_world.rotation, arm.camera_from_world.translation_mm);
    stored.own_flip = xray.orientation.is_mirrored() ? ImageFlip::columns : ImageFlip::none;
    stored.assumptions = std::move(xray.assumptions);
    if (hints.flip && (*hints.flip == ImageFlip::none) != (*stored.own_flip == ImageFlip::none)) {
        // The person says that the tags are wrong about the mirror: the stored columns run the other way.
        const Eigen::Matrix3d mirror = flip_matrix(ImageFlip::columns, stored.size_px);
        stored.pixel_from_world = mirror * stored.pixel_from_world;
    }
    GeometryView view = finish_view(std::move(stored), hints, path.stem().string(), where);
    view.is_dicom = true;
    view.frame = frame;
    return {view};
}

}  // namespace raylign::detail
