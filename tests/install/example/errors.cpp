// tests/install/example/errors.cpp
#include <cstdio>
#include <cstring>
#include <thread>

#include "scene.h"

/// Exit codes as the program `raylign` has them: 0 done, 1 doubtful, 2 bad input, 3 backend not available.
static int registered(const Patient& patient, const raylign::RegistrationOptions& options) {
    try {
        const raylign::BackendChoice choice = raylign::create_backend("auto");
        const raylign::RigidTransform start = raylign::perturbed_start(patient.truth, patient.targets, 3.0, 1);
        const raylign::RegistrationResult result =
            raylign::register_volume(patient.ct, patient.views, start, options, *choice.backend);
        for (const std::string& reason : result.reasons) std::printf("doubtful: %s\n", reason.c_str());
        return result.ok ? 0 : 1;
    } catch (const raylign::Error& error) {
        std::printf("error: %s\n", error.what());
        return error.kind() == raylign::ErrorKind::unavailable ? 3 : 2;
    }
}

int main() {
    // The library that runs is of the minor version that this was compiled against.
    if (std::strncmp(raylign::version(), RAYLIGN_VERSION, std::strlen("0.2")) != 0) return 1;

    Patient patient;
    int well = -1;
    // Runs may go on at once: each has a backend of its own; the CT and the views are only read.
    std::thread other([&] { well = registered(patient, {}); });
    const int bad_option = registered(patient, {.max_iterations_per_level = 0});
    other.join();

    patient.views[1].image = {};  // a view without an image
    const int bad_input = registered(patient, {});
    return well == 0 && bad_option == 2 && bad_input == 2 ? 0 : 1;
}
