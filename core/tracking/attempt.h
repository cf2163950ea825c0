#pragma once

#include <string>
#include <vector>

#include "raylign/registration.h"

namespace raylign::detail {

/// One registration of a frame, and what the frames before say to it.
struct Attempt {
    RegistrationResult result;
    bool has_result = false;
    bool is_search = false;
    std::string problem;  ///< where there is no result
    double jump_mm = 0;
    bool jumped = false, cost_jumped = false;

    [[nodiscard]] bool believed() const { return has_result && result.ok && !cost_jumped && (is_search || !jumped); }
    /// Doubtful, but more likely right than the prediction: otherwise a lasting change of the images would end a track.
    [[nodiscard]] bool plausible() const { return has_result && !jumped && (!cost_jumped || result.ok); }
};

/// The searches for a frame that was not found near its prediction, narrow ones first, up to `widest`. `first`: what it
/// was registered by.
[[nodiscard]] std::vector<RegistrationOptions> wider_searches(const RegistrationOptions& first, Search widest);

}  // namespace raylign::detail
