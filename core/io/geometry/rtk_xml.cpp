#include <expat.h>

#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <numbers>
#include <sstream>

#include "core/base/error.h"
#include "core/io/decode/small_files.h"
#include "core/io/files/text.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Parameters by element name; those given outside <Projection> hold for all projections that follow.
using Parameters = std::map<std::string, double>;

struct RtkProjection {
    Parameters parameters;
    std::optional<Matrix34> matrix;  ///< as the file states it: detector mm from world
};

/// Where expat stands. Its older function is deprecated from 2.8 on, the newer one missing before.
auto line_number_of(XML_Parser parser) {
#if XML_MAJOR_VERSION > 2 || (XML_MAJOR_VERSION == 2 && XML_MINOR_VERSION >= 8)
    return XML_GetCurrentLineNumber64(parser);
#else
    return XML_GetCurrentLineNumber(parser);
#endif
}

/// Collects what expat reports. Nothing may be thrown through expat's C code: the first fault is kept.
class RtkParser {
public:
    explicit RtkParser(const std::filesystem::path& path) : name_(path.string()) {
        constexpr std::uintmax_t kLargest = std::uintmax_t{4} << 30;
        const std::uintmax_t bytes = std::filesystem::file_size(path);
        if (bytes > kLargest) throw bad_value("size", std::to_string(bytes) + " bytes", "at most 4 GB", name_);
    }

    std::vector<RtkProjection> parse() {
        const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                             &XML_ParserFree);
        parser_ = parser.get();
        XML_SetUserData(parser_, this);
        XML_SetElementHandler(parser_, &RtkParser::start, &RtkParser::end);
        XML_SetCharacterDataHandler(parser_, &RtkParser::characters);
        std::ifstream file(name_, std::ios::binary);
        std::vector<char> part(1 << 16);
        for (bool is_last = false; !is_last;) {
            file.read(part.data(), static_cast<std::streamsize>(part.size()));
            is_last = !file;
            const auto status = XML_Parse(parser_, part.data(), static_cast<int>(file.gcount()), is_last ? 1 : 0);
            if (!fault_.empty()) throw Error(fault_);
            if (status != XML_STATUS_OK) {
                throw Error(name_ + " is not valid XML: " + XML_ErrorString(XML_GetErrorCode(parser_)) + " at line " +
                            std::to_string(line_number_of(parser_)));
            }
        }
        if (projections_.empty()) throw Error(name_ + " has no Projection (RTK geometry)");
        return projections_;
    }

private:
    static void start(void* self, const XML_Char* name, const XML_Char** attributes) {
        static_cast<RtkParser*>(self)->start_element(name, attributes);
    }
    static void end(void* self, const XML_Char* name) { static_cast<RtkParser*>(self)->end_element(name); }
    static void characters(void* self, const XML_Char* text, int length) {
        static_cast<RtkParser*>(self)->add_characters({text, static_cast<std::size_t>(length)});
    }

    void fail(const std::string& what) {
        if (fault_.empty()) fault_ = what;
        XML_StopParser(parser_, XML_FALSE);
    }

    void add_characters(std::string_view text) {
        constexpr std::size_t kLongest = 4096;  // of the text of an element: a matrix has less than 400
        if (value_.size() + text.size() > kLongest) return fail("text of more than 4096 characters in " + name_);
        value_ += text;
    }

    void start_element(const std::string& name, const XML_Char** attributes) {
        value_.clear();
        if (depth_++ == 0 && name != "RTKThreeDCircularGeometry") {
            fail("root element = " + name + " in " + name_ + ": must be RTKThreeDCircularGeometry");
        }
        for (; *attributes != nullptr; attributes += 2) {
            const std::string version = attributes[1];
            if (std::string(*attributes) == "version" && version != "2" && version != "3") {
                fail("version = " + version + " in " + name_ + ": must be 2 or 3");
            }
        }
        if (name == "Projection") current_ = {common_, std::nullopt};
        in_projection_ = in_projection_ || name == "Projection";
    }

    void end_element(const std::string& name) {
        --depth_;
        if (name == "Projection") {
            constexpr std::size_t kMostProjections = 100000;
            if (projections_.size() == kMostProjections) return fail(name_ + " has more than 100000 projections");
            projections_.push_back(current_);
            in_projection_ = false;
        } else if (name == "Matrix") {
            take_matrix();
        } else if (depth_ > 0) {
            const std::optional<double> number = number_from(value_);
            if (!number || !std::isfinite(*number)) {
                return fail(name + " = \"" + value_.substr(0, 40) + "\" in " + name_ + ": must be a finite number");
            }
            (in_projection_ ? current_.parameters : common_)[name] = *number;
        }
        value_.clear();
    }

    void take_matrix() {
        std::istringstream stream(value_);
        Matrix34 matrix;
        std::string word;
        for (int i = 0; i < 12; ++i) {
            const std::optional<double> number = stream >> word ? number_from(word) : std::nullopt;
            if (!number) return fail("Matrix in " + name_ + ": must be 12 numbers");
            matrix(i / 4, i % 4) = *number;
        }
        current_.matrix = matrix;
    }

    std::string name_, value_, fault_;
    XML_Parser parser_ = nullptr;
    int depth_ = 0;
    bool in_projection_ = false;
    Parameters common_;
    RtkProjection current_;
    std::vector<RtkProjection> projections_;
};

/// R = Rz(-in_plane) Rx(-out_of_plane) Ry(-gantry), angles in radians: ITK's Euler order ZXY.
Eigen::Matrix3d rtk_rotation(double gantry, double out_of_plane, double in_plane) {
    const double a = -out_of_plane, b = -gantry, c = -in_plane;
    Eigen::Matrix3d x, y, z;
    x << 1, 0, 0, 0, std::cos(a), -std::sin(a), 0, std::sin(a), std::cos(a);
    y << std::cos(b), 0, std::sin(b), 0, 1, 0, -std::sin(b), 0, std::cos(b);
    z << std::cos(c), -std::sin(c), 0, std::sin(c), std::cos(c), 0, 0, 0, 1;
    return z * x * y;
}

double parameter(const RtkProjection& projection, const std::string& name) {
    const auto found = projection.parameters.find(name);
    return found == projection.parameters.end() ? 0 : found->second;
}

/// Detector mm from world, third row = depth: the formula of read_rtk.
Matrix34 detector_from_world(const RtkProjection& p, const std::string& where) {
    for (const char* name : {"SourceToIsocenterDistance", "SourceToDetectorDistance", "GantryAngle"}) {
        if (!p.parameters.contains(name)) throw Error(std::string(name) + " is missing in " + where);
    }
    if (parameter(p, "RadiusCylindricalDetector") != 0) {
        throw Error("RadiusCylindricalDetector in " + where + ": curved detectors are not read");
    }
    const double sid = parameter(p, "SourceToIsocenterDistance"), sdd = parameter(p, "SourceToDetectorDistance");
    if (!(sid > 0) || !(sdd >= sid)) {
        throw Error("SourceToIsocenterDistance = " + number_text(sid) +
                    " mm and SourceToDetectorDistance = " + number_text(sdd) + " mm in " + where +
                    ": must be positive, the detector behind the isocentre (0: parallel rays are not read)");
    }
    const Eigen::Vector2d source(parameter(p, "SourceOffsetX"), parameter(p, "SourceOffsetY"));
    const Eigen::Vector2d detector(parameter(p, "ProjectionOffsetX"), parameter(p, "ProjectionOffsetY"));
    const Eigen::Matrix3d rotation =
        rtk_rotation(kDegree * parameter(p, "GantryAngle"), kDegree * parameter(p, "OutOfPlaneAngle"),
                     kDegree * parameter(p, "InPlaneAngle"));
    Matrix34 extrinsics;  // x' - source_x, y' - source_y, sid - z'
    extrinsics << Eigen::Vector3d(1, 1, -1).asDiagonal() * rotation, Eigen::Vector3d(-source.x(), -source.y(), sid);
    Eigen::Matrix3d intrinsics;
    intrinsics << sdd, 0, source.x() - detector.x(), 0, sdd, source.y() - detector.y(), 0, 0, 1;
    return intrinsics * extrinsics;
}

void check_against_matrix(const RtkProjection& p, const Matrix34& computed, const std::string& where) {
    // RTK's own bound (0.001) on matrices of the scale that it writes: last row = -(depth row).
    if (p.matrix && !((*p.matrix + computed).cwiseAbs().maxCoeff() <= 0.001)) {
        throw Error("the Matrix in " + where + " contradicts the projection's parameters");
    }
}

GeometryView view_of(const RtkProjection& p, const GeometryHints& hints, const std::string& name,
                     const std::string& where) {
    const Matrix34 detector = detector_from_world(p, where);
    check_against_matrix(p, detector, where);
    StoredProjection stored;
    stored.size_px = settled_size(std::nullopt, hints, where);
    if (!hints.pixel_pitch_mm) {
        throw Error(where + " does not say the pixels' size: give pixel_pitch_mm, the projections' spacing");
    }
    const Eigen::Vector2d pitch = *hints.pixel_pitch_mm;
    if (!(pitch.minCoeff() > 0)) throw Error("pixel_pitch_mm for " + where + ": must be two positive numbers");
    const Eigen::Vector2d middle = (stored.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
    const Eigen::Vector2d origin = hints.detector_origin_mm.value_or(-middle.cwiseProduct(pitch));
    Eigen::Matrix3d pixel_from_detector = Eigen::Matrix3d::Identity();
    for (int axis = 0; axis < 2; ++axis) {
        pixel_from_detector(axis, axis) = 1 / pitch[axis];
        pixel_from_detector(axis, 2) = -origin[axis] / pitch[axis];
    }
    stored.pixel_from_world = pixel_from_detector * detector;
    stored.sdd_mm = parameter(p, "SourceToDetectorDistance");
    stored.own_flip = ImageFlip::rows;
    stored.assumptions = {
        "RTK: the world is RTK's fixed frame (IEC 61217, y the rotation axis), rows of the stored "
        "projection run along +v, upwards"};
    if (!hints.detector_origin_mm) {
        stored.assumptions.push_back("detector_origin_mm is not given: the projection's middle is at (0, 0) mm");
    }
    return finish_view(std::move(stored), hints, name, where);
}

}  // namespace

std::vector<GeometryView> read_rtk(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    refuse_hint(hints.sad_mm || hints.sdd_mm, "sad_mm or sdd_mm", "RTK's XML", where);
    refuse_hint(hints.primary_angle_deg || hints.secondary_angle_deg, "an angle", "RTK's XML", where);
    refuse_hint(hints.unit_mm.has_value(), "unit_mm", "RTK's XML", where);
    refuse_hint(hints.undistorted.has_value(), "undistorted", "RTK's XML", where);
    try_in_own_process(path, [](const std::filesystem::path& file) { (void)RtkParser(file).parse(); });  // expat
    const std::vector<RtkProjection> projections = RtkParser(path).parse();
    const int count = static_cast<int>(projections.size());
    if (hints.item < 0 || hints.item > count) {
        throw bad_value("projection", std::to_string(hints.item), "in [1, " + std::to_string(count) + "]", where);
    }
    std::vector<GeometryView> views;
    for (int i = 1; i <= count; ++i) {
        if (hints.item != 0 && hints.item != i) continue;
        const std::string number = std::to_string(i);
        views.push_back(view_of(projections[static_cast<std::size_t>(i - 1)], hints,
                                path.stem().string() + (count > 1 ? "_" + number : ""),
                                count > 1 ? where + ", projection " + number : where));
    }
    return views;
}

}  // namespace detail

namespace {

using detail::number_text;

std::string element(const std::string& name, double value) {
    return "    <" + name + ">" + number_text(value) + "</" + name + ">\n";
}

std::string rtk_projection_text(const ViewGeometry& view) {
    const Camera& camera = view.camera;
    const double sdd_mm = camera.sdd_mm.value_or(0);
    const Eigen::Vector2d pitch = camera.pixel_pitch_mm().value_or(Eigen::Vector2d::Ones());
    // RTK's rotated axes: x' along columns, y' up, z' towards the source.
    const Eigen::Matrix3d r = Eigen::Vector3d(1, -1, -1).asDiagonal() * view.camera_from_world.rotation;
    const Eigen::Vector3d source = r * source_world_mm(view);
    if (!(source.z() > 0)) throw Error("RTK's geometry needs the world's origin in front of the source");
    const bool is_locked = std::abs(r(2, 1)) > 1 - 1e-12;  // gantry and in-plane axes coincide: in-plane is set 0
    const double a = std::asin(std::clamp(r(2, 1), -1.0, 1.0));
    const double b = is_locked ? std::atan2(r(0, 2), r(0, 0)) : std::atan2(-r(2, 0), r(2, 2));
    const double c = is_locked ? 0 : std::atan2(-r(0, 1), r(1, 1));
    const Eigen::Vector2d middle = (camera.size_px.cast<double>() - Eigen::Vector2d::Ones()) / 2;
    const Eigen::Vector2d off = (camera.intrinsics_px.topRightCorner<2, 1>() - middle).cwiseProduct(pitch);
    detail::RtkProjection p;
    p.parameters = {{"GantryAngle", -b / detail::kDegree},
                    {"OutOfPlaneAngle", -a / detail::kDegree},
                    {"InPlaneAngle", -c / detail::kDegree},
                    {"SourceToIsocenterDistance", source.z()},
                    {"SourceToDetectorDistance", sdd_mm},
                    {"SourceOffsetX", source.x()},
                    {"SourceOffsetY", source.y()},
                    {"ProjectionOffsetX", source.x() - off.x()},
                    {"ProjectionOffsetY", source.y() + off.y()}};
    std::string text = "  <Projection>\n";
    for (const auto& [name, value] : p.parameters) text += element(name, value);
    const detail::Matrix34 matrix = -detail::detector_from_world(p, "the view");
    text += "    <Matrix>\n";
    for (int row = 0; row < 3; ++row) {
        text += "     ";
        for (int column = 0; column < 4; ++column) text += " " + number_text(matrix(row, column));
        text += "\n";
    }
    return text + "    </Matrix>\n  </Projection>\n";
}

}  // namespace

std::string rtk_text(std::span<const ViewGeometry> views, std::vector<std::string>& notes) {
    std::string text = "<?xml version=\"1.0\"?>\n<!DOCTYPE RTKGEOMETRY>\n<RTKThreeDCircularGeometry version=\"3\">\n";
    for (const ViewGeometry& view : views) {
        if (!view.camera.sdd_mm) throw Error("RTK's geometry needs the detector's distance: give sdd_mm");
        if (view.camera.intrinsics_px(0, 1) != 0) throw Error("RTK's geometry has no place for skewed pixels");
        text += rtk_projection_text(view);
        const Eigen::Vector2d pitch = *view.camera.pixel_pitch_mm();
        notes.push_back("RTK: give it the image with its rows in reverse order, spacing (" + number_text(pitch.x()) +
                        ", " + number_text(pitch.y()) + ") mm, its middle at the origin (0, 0)");
    }
    return text + "</RTKThreeDCircularGeometry>\n";
}

}  // namespace raylign
