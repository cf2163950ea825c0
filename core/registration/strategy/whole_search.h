#pragma once

#include "core/registration/strategy/descent.h"

namespace raylign::detail {

/// A whole, coarse to fine from many starts: those of least cost are refined a little, the best of them further, on
/// ever finer levels; the finalists are compared under weights that are fair to each.
void search_whole(Run& run, Search mode, StartCheck check);

}  // namespace raylign::detail
