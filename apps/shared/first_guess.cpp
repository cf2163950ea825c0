#include "apps/shared/first_guess.h"

#include <algorithm>

#include "apps/shared/parse.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/text.h"
#include "core/io/poses/pose_file.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"
#include "raylign/start.h"

namespace raylign::detail::apps {
namespace {

std::size_t view_named(const std::string& name, const ViewsFile& views) {
    std::vector<std::string> names;
    for (const View& view : views.views) names.push_back(view.name);
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) throw bad_value("view of --landmarks", name, "one of " + joined(names));
    return static_cast<std::size_t>(found - names.begin());
}

/// Points are marked on pixels as stored; the camera is that of the turned, undistorted image.
Eigen::Vector2d camera_pixel(Eigen::Vector2d pixel, const ViewOrigin& origin, const Camera& camera) {
    if (origin.flip == ImageFlip::columns) pixel.x() = camera.size_px.x() - 1 - pixel.x();
    if (origin.flip == ImageFlip::rows) pixel.y() = camera.size_px.y() - 1 - pixel.y();
    return origin.distortion ? undistorted_px(camera, *origin.distortion, pixel) : pixel;
}

std::size_t landmark_of(const ImagePoint& point, std::size_t row, const std::vector<Landmark>& landmarks,
                        const std::string& file) {
    if (point.name.empty()) {
        if (row < landmarks.size()) return row;
        throw bad_value("points in " + file, "more than " + std::to_string(landmarks.size()),
                        "as many as landmarks, or named");
    }
    std::vector<std::string> names;
    for (const Landmark& landmark : landmarks) names.push_back(landmark.name);
    const auto found = std::ranges::find(names, point.name);
    if (found == names.end()) throw bad_value("point", point.name, "one of the landmarks " + joined(names), file);
    return static_cast<std::size_t>(found - names.begin());
}

FirstGuess guess_by_landmarks(const StartFlags& flags, const ViewsFile& views) {
    FirstGuess guess;
    const std::vector<Landmark> landmarks = read_landmarks(flags.landmarks3d);
    guess.files.push_back(flags.landmarks3d);
    std::vector<LandmarkSighting> sightings;
    std::vector<std::string> labels;
    for (const std::string& argument : flags.landmarks) {
        const auto [view_name, file] = split_named(argument, "--landmarks", "VIEW=FILE");
        const std::size_t view = view_named(view_name, views);
        const std::vector<ImagePoint> points = read_image_points(file);
        guess.files.emplace_back(file);
        for (std::size_t row = 0; row < points.size(); ++row) {
            const std::size_t landmark = landmark_of(points[row], row, landmarks, file);
            sightings.push_back(
                {landmark, view,
                 camera_pixel(points[row].pixel, views.origins[view], views.views[view].geometry.camera)});
            const std::string& name = landmarks[landmark].name;
            labels.push_back((name.empty() ? std::to_string(landmark + 1) : name) + " in " + view_name);
        }
    }
    std::vector<Eigen::Vector3d> points_ct_mm;
    for (const Landmark& landmark : landmarks) points_ct_mm.push_back(landmark.x_ct_mm);
    std::vector<ViewGeometry> geometries;
    for (const View& view : views.views) geometries.push_back(view.geometry);
    const LandmarkPose pose = pose_from_landmarks(points_ct_mm, geometries, sightings);
    guess.world_from_ct = pose.world_from_ct;
    const auto worst = std::ranges::max_element(pose.residuals_px);
    guess.notes.push_back("start by " + std::to_string(sightings.size()) + " landmark points: they are met within " +
                          fixed(pose.rms_mm, 2) + " mm (" + fixed(pose.rms_px, 2) + " px) RMS, worst " +
                          labels[static_cast<std::size_t>(worst - pose.residuals_px.begin())] + " with " +
                          fixed(*worst, 2) + " px");
    constexpr double kDoubtful_mm = 10;
    if (pose.rms_mm > kDoubtful_mm) {
        guess.notes.emplace_back("the landmarks fit badly: are points swapped, or columns and rows?");
    }
    if (pose.second_rms_px < 1.5 * pose.rms_px + 0.5) {
        guess.notes.push_back("another pose fits the landmarks almost as well (" + fixed(pose.second_rms_px, 2) +
                              " px): add one out of their plane, or another view");
    }
    return guess;
}

FirstGuess guess_by_dicom(const VoxelGrid& grid, const ViewsFile& views) {
    FirstGuess guess;
    for (std::size_t i = 0; i < views.views.size(); ++i) {
        if (views.origins[i].is_dicom_geometry) continue;
        throw Error("--start dicom: the geometry of view " + views.views[i].name + " is not from a DICOM file");
    }
    for (const ViewOrigin& origin : views.origins) {
        if (!origin.isocentre_ct_mm) continue;
        guess.world_from_ct = RigidTransform::translate(-*origin.isocentre_ct_mm);
        guess.notes.emplace_back(
            "start by DICOM: the plan's isocentre lies in the world's origin, patient axes as "
            "stated");
        return guess;
    }
    guess.world_from_ct = default_start(grid, views.views);
    guess.notes.emplace_back(
        "start by DICOM: patient axes as stated, the CT's centre where the central rays meet (the "
        "isocentre)");
    return guess;
}

const PoseSequence& sequence_of(const std::vector<PoseSequence>& sequences, const std::string& object,
                                const std::filesystem::path& file) {
    const auto found = std::ranges::find(sequences, object, &PoseSequence::object);
    if (found != sequences.end()) return *found;
    if (sequences.size() == 1) return sequences.front();
    throw bad_value("object of the start", object.empty() ? "none" : object,
                    "one of " + joined(sequences, &PoseSequence::object, ", "), file.string());
}

RigidTransform only_pose(const PoseSequence& sequence, const std::filesystem::path& file) {
    if (sequence.frames.size() == 1 && sequence.frames.front().world_from_ct) {
        return *sequence.frames.front().world_from_ct;
    }
    throw bad_value("poses of the start", std::to_string(sequence.frames.size()),
                    "1 here: take one out by raylign poses FILE --frame N -o pose.json", file.string());
}

/// The pose of the frame that is registered first.
RigidTransform read_start(const std::filesystem::path& file, const StartFrame& frame) {
    const PoseFileFormat format = pose_file_format(file);
    if (format == PoseFileFormat::single) return read_pose(file, frame.ct);
    const std::vector<PoseSequence> sequences = read_pose_file(file, {.shown_grids = {frame.shown_grid}, .tra = {}});
    const PoseSequence& sequence = sequence_of(sequences, frame.object, file);
    if (frame.line == 0) return only_pose(sequence, file);
    const bool is_numbered = format == PoseFileFormat::trajectory;
    const int wanted = is_numbered ? frame.number : frame.line;
    for (std::size_t i = 0; i < sequence.frames.size(); ++i) {
        const int at = is_numbered ? sequence.frames[i].frame : static_cast<int>(i) + 1;
        if (at == wanted && sequence.frames[i].world_from_ct) return *sequence.frames[i].world_from_ct;
    }
    throw Error(file.string() + " has no pose for the first frame, " + std::to_string(frame.number) +
                (is_numbered ? "" : " (its row " + std::to_string(wanted) + ")") +
                ": begin at a frame that has one (--first N), or give another start");
}

}  // namespace

FirstGuess first_guess(const StartFlags& flags, const VoxelGrid& grid, const ViewsFile& views,
                       const StartFrame& frame) {
    if (!flags.landmarks.empty()) return guess_by_landmarks(flags, views);
    if (flags.pose == "dicom") return guess_by_dicom(grid, views);
    if (!flags.pose.empty()) return {read_start(flags.pose, frame), {}, {flags.pose}};
    const bool all_dicom = std::ranges::all_of(views.origins, &ViewOrigin::is_dicom_geometry);
    if (all_dicom) return guess_by_dicom(grid, views);
    return {
        default_start(grid, views.views),
        {"no --start: started with the CT's centre where the views' central rays meet, patient axes parallel to the "
         "world's"},
        {}};
}

}  // namespace raylign::detail::apps
