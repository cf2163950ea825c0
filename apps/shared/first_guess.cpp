#include "apps/shared/first_guess.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/error.h"
#include "raylign/io/landmarks.h"
#include "raylign/io/pose.h"
#include "raylign/start.h"

namespace raylign::detail::apps {
namespace {

std::string fixed(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f", value);
    return text;
}

std::size_t view_named(const std::string& name, const ViewsFile& views) {
    std::string names;
    for (std::size_t i = 0; i < views.views.size(); ++i) {
        if (views.views[i].name == name) return i;
        names += (names.empty() ? "" : ", ") + views.views[i].name;
    }
    throw bad_value("view of --landmarks", name, "one of " + names);
}

/// Points are marked on pixels as stored; the camera is that of the turned image.
Eigen::Vector2d turned(Eigen::Vector2d pixel, ImageFlip flip, const Eigen::Vector2i& size_px) {
    if (flip == ImageFlip::columns) pixel.x() = size_px.x() - 1 - pixel.x();
    if (flip == ImageFlip::rows) pixel.y() = size_px.y() - 1 - pixel.y();
    return pixel;
}

std::size_t landmark_of(const ImagePoint& point, std::size_t row, const std::vector<Landmark>& landmarks,
                        const std::string& file) {
    if (point.name.empty()) {
        if (row < landmarks.size()) return row;
        throw bad_value("points in " + file, "more than " + std::to_string(landmarks.size()),
                        "as many as landmarks, or named");
    }
    std::string names;
    for (std::size_t i = 0; i < landmarks.size(); ++i) {
        if (landmarks[i].name == point.name) return i;
        names += (names.empty() ? "" : ", ") + landmarks[i].name;
    }
    throw bad_value("point", point.name, "one of the landmarks " + names, file);
}

/// "VIEW=FILE"
std::pair<std::string, std::string> view_and_file(const std::string& argument) {
    const std::size_t equals = argument.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == argument.size()) {
        throw bad_value("--landmarks", argument, "VIEW=FILE");
    }
    return {argument.substr(0, equals), argument.substr(equals + 1)};
}

FirstGuess guess_by_landmarks(const StartWishes& wishes, const ViewsFile& views) {
    FirstGuess guess;
    const std::vector<Landmark> landmarks = read_landmarks(wishes.landmarks3d);
    guess.files.push_back(wishes.landmarks3d);
    std::vector<LandmarkSighting> sightings;
    std::vector<std::string> labels;
    for (const std::string& argument : wishes.landmarks) {
        const auto [view_name, file] = view_and_file(argument);
        const std::size_t view = view_named(view_name, views);
        const std::vector<ImagePoint> points = read_image_points(file);
        guess.files.emplace_back(file);
        for (std::size_t row = 0; row < points.size(); ++row) {
            const std::size_t landmark = landmark_of(points[row], row, landmarks, file);
            sightings.push_back(
                {landmark, view,
                 turned(points[row].pixel, views.origins[view].flip, views.views[view].geometry.camera.size_px)});
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
                          fixed(pose.rms_mm) + " mm (" + fixed(pose.rms_px) + " px) RMS, worst " +
                          labels[static_cast<std::size_t>(worst - pose.residuals_px.begin())] + " with " +
                          fixed(*worst) + " px");
    constexpr double kDoubtful_mm = 10;
    if (pose.rms_mm > kDoubtful_mm) {
        guess.notes.emplace_back("the landmarks fit badly: are points swapped, or columns and rows?");
    }
    if (pose.second_rms_px < 1.5 * pose.rms_px + 0.5) {
        guess.notes.push_back("another pose fits the landmarks almost as well (" + fixed(pose.second_rms_px) +
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

}  // namespace

void check_wishes(const StartWishes& wishes) {
    if (wishes.landmarks.empty() != wishes.landmarks3d.empty()) {
        throw Error(wishes.landmarks.empty()
                        ? "--landmarks3d needs the points in the images: give --landmarks VIEW=FILE"
                        : "--landmarks needs the points in the CT: give --landmarks3d FILE");
    }
    if (!wishes.landmarks.empty() && !wishes.start.empty()) {
        throw Error("--start contradicts --landmarks: must be one of them");
    }
    for (const std::string& argument : wishes.landmarks) (void)view_and_file(argument);
}

FirstGuess first_guess(const StartWishes& wishes, const VoxelGrid& grid, const ViewsFile& views) {
    if (!wishes.landmarks.empty()) return guess_by_landmarks(wishes, views);
    if (wishes.start == "dicom") return guess_by_dicom(grid, views);
    if (!wishes.start.empty()) return {read_pose(wishes.start), {}, {wishes.start}};
    const bool all_dicom = std::ranges::all_of(views.origins, &ViewOrigin::is_dicom_geometry);
    if (all_dicom) return guess_by_dicom(grid, views);
    return {
        default_start(grid, views.views),
        {"no --start: started with the CT's centre where the views' central rays meet, patient axes parallel to the "
         "world's"},
        {}};
}

}  // namespace raylign::detail::apps
