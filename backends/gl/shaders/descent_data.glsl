// Structs of searches that the device runs by itself (advance.comp). C++ includes this file, too (shared.h): arrays of doubles, then
// words in pairs, so that std430 and C++ lay them out alike. Matrices are row by row.

const uint kDescentSteps = 4;  // of every search, in one submission

/// What all searches have in common. Lengths of steps are in mm at the rim.
struct DescentData {
    double voxel_from_ct[9];  // without the shift
    double origin_ct[3];      // of voxel (0, 0, 0) [mm]
    double first_voxel[3];    // of the volume on the device
    double size_voxels[3];
    double centre_ct[3];      // about which the volume turns [mm]
    double radius;            // of its rim [mm]
    double max_step, step_tolerance, decrease_tolerance;  // LevenbergMarquardtOptions
    double longest_of_plain, damping_down, damping_up, least_damping_up, least_damping, largest_damping, least_of_diagonal;
    double constant_share;    // of the second moment, below which a variance is rounding
    double axis_bias;         // twice dominant_axis's: floats may choose the neighbour of what doubles choose
    double farthest_source;   // [voxel]
    uint searches, views, channels, max_iterations;
    uint learns, layouts;     // bit n: layers across axis n are there
    uint chunk_frames, chunks;
    uint cast_groups[2], sums_groups[2];  // across and down
};

/// One view of the scene, in world.
struct CameraData {
    double source[3];            // [mm]
    double world_from_pixel[9];
    double depth_max, ceiling, share;
    double static_sums[6];       // per channel: sum w, sum w A, sum w A^2
};

/// Cost, gradient and Gauss-Newton matrix (upper triangle) of one view, per rad and mm.
struct ViewModel {
    double cost;
    double gradient[6];
    double curvature[21];
};

const uint kToLook = 0;     // its trial pose has not been looked at
const uint kKnown = 1;      // its trial pose, with what its views say, is where it begins
const uint kLooking = 2;    // the trial pose's frames are submitted
const uint kDone = 3;
const uint kRefused = 4;    // no rays can be made for the trial pose

/// As LevenbergMarquardtSearch, with its poses: world_from_ct as a rotation and a translation [mm].
struct SearchData {
    double base[12], trial[12];
    double step[6];              // from base to trial
    double cost, gradient[6], curvature[36];  // at base, of all views, per mm at the rim
    double missing[36];
    double damping, last_length;
    double taken_poses[48], taken_costs[4], taken_lengths[4];  // of steps accepted in this submission
    uint state, termination, iterations, linearizations;
    uint frame;                  // of its first view, in work
    uint taken;                  // steps accepted in this submission
    uint needed_layouts;         // bits that DescentData::layouts lacks
    uint is_fresh;               // nothing is known at its base
};
