#pragma once

#include "core/registration/level/run.h"

namespace raylign::detail {

/// A part: all orientations and places by templates (template_search.h), the best of them judged each on the pixels
/// that it covers. One domain for all would compare how well each fits everything else: on a real wrist the right pose
/// was 50th by that and first by its own pixels.
void search_part(Run& run, Search mode);

}  // namespace raylign::detail
