#pragma once

#include "core/registration/level/run.h"

namespace raylign::detail {

/// A part whose place the run's start tells to about a millimetre, as a prediction from the frames before does: one
/// level, its images cut to what the part reaches there, one descent, robust weights from its end, a second descent,
/// and the expected error of that level. `coarser_by`: how many levels above the finest, as far as there are any. Its
/// costs are those of its level: noise is averaged away on a coarser one, so that they are lower there.
void follow(Run& run, int coarser_by);

}  // namespace raylign::detail
