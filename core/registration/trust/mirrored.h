#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>

#include "raylign/result.h"
#include "raylign/view.h"

namespace raylign::detail {

/// The view as its observer's image: columns reversed, image and weights alike. The camera stays.
[[nodiscard]] View with_columns_reversed(View view);

/// Final cost of a registration of these views; not a number where there is none, as where the mirrored mask leaves
/// nothing of the DRR.
using CostOfViews = std::function<double(std::span<const View>)>;

/// For a result that correlates weakly: whether the images fit far better with the columns of some views reversed; all
/// subsets of up to three views are tried, none of more. X-rays are stored as the source or as an observer sees them,
/// and files do not always say which. Says so in words for people, naming views and costs; nothing is changed. Each try
/// is a registration of its own.
[[nodiscard]] std::optional<std::string> mirror_suspicion(std::span<const View> views, const RegistrationResult& found,
                                                          const CostOfViews& cost_of);

}  // namespace raylign::detail
