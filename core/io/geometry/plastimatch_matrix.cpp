#include <cmath>
#include <cstdio>

#include "core/base/error.h"
#include "core/io/files/text.h"
#include "core/io/geometry/importers.h"
#include "core/io/geometry/number_text_reader.h"
#include "core/io/geometry/stored_projection.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

/// What the file holds, in its order.
struct PlastimatchFile {
    Eigen::Vector2d centre_px;
    Matrix34 matrix;
    double sad_mm = 0, sdd_mm = 0;
    Eigen::Vector3d normal;
    std::optional<Eigen::Matrix4d> extrinsic;
    std::optional<Matrix34> intrinsic;
};

class Lines {
public:
    explicit Lines(const std::filesystem::path& path) : path_(path), lines_(text_lines(path)) {}

    [[nodiscard]] bool at_end() const { return next_ == lines_.size(); }

    Eigen::MatrixXd matrix(int rows, int columns, const std::string& what) {
        Eigen::MatrixXd matrix(rows, columns);
        for (int r = 0; r < rows; ++r) {
            if (at_end()) throw Error(what + " is missing in " + path_.string() + " (plastimatch's projection matrix)");
            const auto numbers = line_numbers(lines_[next_++], static_cast<std::size_t>(columns), what, path_);
            for (int c = 0; c < columns; ++c) matrix(r, c) = numbers[static_cast<std::size_t>(c)];
        }
        return matrix;
    }

    void heading(const std::string& word) {
        if (at_end() || lower_case(lines_[next_].text) != lower_case(word)) {
            throw Error("\"" + word + "\" is missing in " + path_.string() + " (plastimatch's projection matrix)");
        }
        ++next_;
    }

private:
    std::filesystem::path path_;
    std::vector<TextLine> lines_;
    std::size_t next_ = 0;
};

PlastimatchFile parse(const std::filesystem::path& path) {
    Lines lines(path);
    PlastimatchFile file;
    file.centre_px = lines.matrix(1, 2, "image centre").transpose();
    file.matrix = lines.matrix(3, 4, "matrix");
    file.sad_mm = lines.matrix(1, 1, "source to axis distance")(0, 0);
    file.sdd_mm = lines.matrix(1, 1, "source to image distance")(0, 0);
    file.normal = lines.matrix(1, 3, "normal").transpose();
    if (lines.at_end()) return file;
    lines.heading("Extrinsic");
    file.extrinsic = lines.matrix(4, 4, "extrinsic");
    lines.heading("Intrinsic");
    file.intrinsic = lines.matrix(3, 4, "intrinsic");
    return file;
}

/// The file says everything twice: both must agree to the digits written.
void check_consistent(const PlastimatchFile& file, const std::string& where) {
    if (!(file.sdd_mm > 0)) throw bad_value("source to image distance", number_text(file.sdd_mm), "positive", where);
    // P_3 x = depth / sid, so the length of its linear part is 1 / sid.
    const double stated = file.matrix.block<1, 3>(2, 0).norm() * file.sdd_mm;
    if (!(std::abs(stated - 1) < 1e-5)) {
        throw Error("source to image distance = " + number_text(file.sdd_mm) + " mm in " + where +
                    " contradicts the matrix, whose third row says " + number_text(file.sdd_mm / stated) + " mm");
    }
    if (!file.extrinsic) return;
    const Matrix34 product = file.intrinsic->leftCols<3>() * file.extrinsic->topRows<3>();
    if (!((product - file.matrix).cwiseAbs().maxCoeff() < 1e-5 * file.matrix.cwiseAbs().maxCoeff())) {
        throw Error("the matrix in " + where + " contradicts its extrinsic and intrinsic parts");
    }
}

}  // namespace

std::vector<GeometryView> read_plastimatch(const std::filesystem::path& path, const GeometryHints& hints) {
    const std::string where = path.string();
    for (const auto& [is_given, what] : {std::pair{hints.pixel_pitch_mm.has_value(), "pixel_pitch_mm"},
                                         {hints.detector_origin_mm.has_value(), "detector_origin_mm"},
                                         {hints.sad_mm.has_value(), "sad_mm"},
                                         {hints.sdd_mm.has_value(), "sdd_mm"},
                                         {hints.unit_mm.has_value(), "unit_mm"},
                                         {hints.undistorted.has_value(), "undistorted"},
                                         {hints.primary_angle_deg || hints.secondary_angle_deg, "an angle"},
                                         {hints.item != 0, "a frame or projection"}}) {
        refuse_hint(is_given, what, "plastimatch's matrix", where);
    }
    const PlastimatchFile file = parse(path);
    check_consistent(file, where);
    StoredProjection stored;
    stored.size_px = settled_size(std::nullopt, hints, where);
    Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
    centred.topRightCorner<2, 1>() = file.centre_px;
    stored.pixel_from_world = centred * file.matrix;
    stored.sdd_mm = file.sdd_mm;
    stored.assumptions = {
        "plastimatch: pixel = image centre + (P1 x, P2 x) / (P3 x), rows down, pixel centres at integers; the world is "
        "the CT's LPS [mm]"};
    return {finish_view(std::move(stored), hints, path.stem().string(), where)};
}

}  // namespace detail

std::string plastimatch_text(const ViewGeometry& view) {
    const Camera& camera = view.camera;
    if (!camera.sdd_mm) throw Error("plastimatch's matrix needs the detector's distance: give sdd_mm");
    if (camera.intrinsics_px(0, 1) != 0) throw Error("plastimatch's matrix has no place for skewed pixels");
    const double sdd_mm = *camera.sdd_mm;
    detail::Matrix34 extrinsic;
    extrinsic << view.camera_from_world.rotation, view.camera_from_world.translation_mm;
    const Eigen::Vector3d scale(camera.intrinsics_px(0, 0) / sdd_mm, camera.intrinsics_px(1, 1) / sdd_mm, 1 / sdd_mm);
    const detail::Matrix34 matrix = scale.asDiagonal() * extrinsic;
    std::string text;
    const auto row = [&text](const Eigen::RowVectorXd& numbers) {
        char number[32];
        for (Eigen::Index i = 0; i < numbers.size(); ++i) {
            // More digits than plastimatch's own %18.8e: it reads any, and 8 lose 1e-5 px.
            std::snprintf(number, sizeof number, i > 0 ? " %24.16e" : "%24.16e", numbers[i]);
            text += number;
        }
        text += "\n";
    };
    row(camera.intrinsics_px.topRightCorner<2, 1>().transpose());
    for (int r = 0; r < 3; ++r) row(matrix.row(r));
    row(Eigen::RowVectorXd::Constant(1, view.camera_from_world.translation_mm.z()));  // depth of the world's origin
    row(Eigen::RowVectorXd::Constant(1, sdd_mm));
    row(extrinsic.row(2).head<3>());
    text += "Extrinsic\n";
    for (int r = 0; r < 3; ++r) row(extrinsic.row(r));
    row(Eigen::RowVector4d(0, 0, 0, 1));
    text += "Intrinsic\n";
    for (int r = 0; r < 3; ++r) {
        Eigen::RowVector4d numbers = Eigen::RowVector4d::Zero();
        numbers[r] = scale[r];
        row(numbers);
    }
    return text;
}

}  // namespace raylign
