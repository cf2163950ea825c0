#pragma once

#include <string>
#include <vector>

#include "raylign/io/trajectory.h"
#include "raylign/phantom.h"
#include "raylign/view.h"
#include "tests/apps/run_program.h"

namespace raylign::detail::test {

/// Two bones of one CT that overlap in two views of 72 x 72 pixels and move on known paths: the thigh sways, the shank
/// bends. Their own volumes lie on grids of their own.
class TrackCase {
public:
    /// Writes femur.mha and tibia.mha (1/mm), geometry.json, f.json and t.json (starts some mm off the first frame).
    explicit TrackCase(const TestFolder& folder);

    /// Poses in a frame (counted from 1); both are the identity where the CT was taken.
    [[nodiscard]] static RigidTransform femur(int frame);
    [[nodiscard]] static RigidTransform tibia(int frame);
    [[nodiscard]] static double flexion_deg(int frame) { return 10 + 4 * frame; }

    /// X-rays of both bones (or of the femur alone), with noise, AP.0001.tif and so on.
    void write_frames(int first, int last) const;
    void write_femur_frames(int first, int last) const;
    void write_frame(const std::string& view, int frame, const Image& image) const;

    /// `track` of both bones into folder "track", and of the femur alone.
    [[nodiscard]] std::vector<std::string> both(const std::vector<std::string>& more = {}) const;
    [[nodiscard]] std::vector<std::string> femur_alone(const std::vector<std::string>& more = {}) const;

    static const Eigen::Vector3d kFemurCentre, kTibiaCentre;  ///< in ct

    [[nodiscard]] Image xray(std::size_t view, int frame, bool with_tibia) const;

private:
    [[nodiscard]] std::string name(const std::string& view, int frame) const;

    const TestFolder& folder_;
    std::vector<View> views_;
};

/// How far a row puts the object's centre from where it is.
[[nodiscard]] inline double centre_error_mm(const TrajectoryRow& row, const RigidTransform& truth,
                                            const Eigen::Vector3d& centre_ct) {
    return (row.frame.world_from_ct * centre_ct - truth * centre_ct).norm();
}

}  // namespace raylign::detail::test
