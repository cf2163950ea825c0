// tests/install/example/own_optimizer.cpp
#include <Eigen/Cholesky>
#include <cstdio>

#include "scene.h"

int main() {
    using namespace raylign;
    const Patient patient;
    const std::unique_ptr<Backend> backend = create_backend("auto").backend;

    // The CT and the X-rays, made resident. Both are borrowed for this call only.
    const std::unique_ptr<Session> session = backend->prepare(Scene{patient.ct, patient.views, {}, {}});

    // A batch of poses: a backend shares the work of all of them. Costs are in [0, 2], lower is better.
    std::vector<RigidTransform> poses;
    for (const double x_mm : {-4.0, 0.0, 4.0}) poses.push_back(RigidTransform::translate({x_mm, 0, 0}) * patient.truth);
    std::vector<double> costs(poses.size());
    session->evaluate(poses, costs);
    std::printf("costs %.4f %.4f %.4f\n", costs[0], costs[1], costs[2]);

    // Gauss-Newton by hand. The twist (rad, mm) acts about the CT's centre, where the pose has put it.
    const Eigen::Vector3d centre_ct_mm = patient.ct.grid.centre_ct_mm();
    RigidTransform world_from_ct = perturbed_start(patient.truth, patient.targets, 2.0, 1);
    for (int iteration = 0; iteration < 10; ++iteration) {
        std::vector<Linearization> at(1);
        session->linearize({&world_from_ct, 1}, centre_ct_mm, at);
        const Twist step = -at[0].curvature.ldlt().solve(at[0].gradient);
        world_from_ct = exp_about(step, world_from_ct * centre_ct_mm) * world_from_ct;
    }
    std::printf("2.00 mm -> %.2f mm\n", patient.error_mm(world_from_ct));

    // What the backend sees from there.
    const Image drr = session->render(world_from_ct, 0);
    const bool is_best = costs[1] < costs[0] && costs[1] < costs[2];
    return is_best && patient.error_mm(world_from_ct) < 1.25 && drr.width == 96 ? 0 : 1;
}
