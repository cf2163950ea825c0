// tests/install/example/scene.h
#pragma once

#include <vector>

#include "raylign/raylign.h"

/// What a hospital would give you, made up: a CT, two X-rays, and, for checking, where the patient really was.
struct Patient {
    raylign::Phantom phantom = raylign::spine_phantom({120, 120, 120});  // [mm]
    raylign::Volume ct = raylign::voxelise(phantom, raylign::centred_grid({48, 48, 48}, {2.5, 2.5, 2.5}));
    std::vector<raylign::View> views = two_views();
    std::vector<Eigen::Vector3d> targets = raylign::default_targets_ct_mm(ct);
    raylign::RigidTransform truth = raylign::RigidTransform::translate({4, -3, 2});  // world_from_ct

    Patient() { take_xrays(truth); }

    /// X-rays of the phantom itself, not of its voxels: no registration of the CT can match them by construction.
    void take_xrays(const raylign::RigidTransform& world_from_ct) {
        for (raylign::View& view : views) view.image = raylign::exact_drr(phantom, view.geometry, world_from_ct);
    }

    /// Two positions of an isocentric C-arm. `view_from_projection_matrix` takes calibrated cameras.
    static std::vector<raylign::View> two_views() {
        const raylign::CArm frontal{.sad_mm = 1000, .sdd_mm = 1500, .pixel_pitch_mm = {2.4, 2.4}, .size_px = {96, 96}};
        raylign::CArm lateral = frontal;
        lateral.primary_angle_deg = 90;
        return {{.name = "AP", .geometry = raylign::view_from_c_arm(frontal)},
                {.name = "LAT", .geometry = raylign::view_from_c_arm(lateral)}};
    }

    /// Mean distance between where a pose puts the targets and where they are (mTRE).
    [[nodiscard]] double error_mm(const raylign::RigidTransform& world_from_ct) const {
        return raylign::mean_target_error_mm(world_from_ct, truth, targets);
    }
};
