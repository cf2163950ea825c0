// tests/install/example/register.cpp
#include <cstdio>

#include "scene.h"

int main() {
    using namespace raylign;
    const Patient patient;
    const RigidTransform start = perturbed_start(patient.truth, patient.targets, 5.0, 1);  // 5 mm off
    const BackendChoice choice = create_backend("auto");

    // Watched and stopped from any thread, or from a signal handler.
    StopSource stop;
    RunControl control{.stop = stop.token()};
    double fraction = 0;
    control.on_progress = [&](const RegistrationProgress& progress) { fraction = progress.fraction; };

    const RegistrationOptions options{.time_limit_s = 60};
    const RegistrationResult result =
        register_volume(patient.ct, patient.views, start, options, *choice.backend, control);
    std::printf("%s: %s\n%s", choice.backend->info().name.c_str(), brief(result).c_str(), full(result).c_str());
    const bool found = result.ok && patient.error_mm(result.world_from_ct) < 1.25;  // half a voxel

    // A run that is stopped gives the best pose so far, and says that it is not to be trusted.
    stop.request_stop();
    const RegistrationResult stopped =
        register_volume(patient.ct, patient.views, start, options, *choice.backend, control);
    const bool told = !stopped.ok && stopped.termination == Termination::stopped;

    return found && told && fraction > 0 ? 0 : 1;
}
