#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/register/inputs.h"
#include "raylign/options.h"
#include "raylign/result.h"

namespace raylign::detail::apps {

/// What --refine-views, --view-prior and --keep-view say. Throws Error where one of the others stands alone, and for
/// flags of the method and the search that refining contradicts.
[[nodiscard]] bool settle_refinement(const RefineFlags& flags, const MethodFlags& method, const SearchFlags& search);

/// The prior for these views. Throws Error for a single view and for a name that none has.
[[nodiscard]] ViewPrior view_prior(const RefineFlags& flags, const std::vector<View>& views);

/// The views with the cameras that the result was found with.
[[nodiscard]] std::vector<View> views_of(const RegistrationResult& result, const std::vector<View>& views);

/// views_refined.json in `folder`: the corrected cameras, with the images, masks and intensities that were read.
[[nodiscard]] std::string refined_views_json(const std::vector<View>& views, const std::vector<ViewOrigin>& origins,
                                             const std::filesystem::path& folder);

}  // namespace raylign::detail::apps
