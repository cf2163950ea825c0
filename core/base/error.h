#pragma once

#include <string>
#include <string_view>

#include "raylign/error.h"

namespace raylign::detail {

/// Formats the usual message: "<what> = <value> in <where>: must be <allowed>". An empty `where` is left out.
[[nodiscard]] inline Error bad_value(std::string_view what, std::string_view value, std::string_view allowed,
                                     std::string_view where = {}) {
    std::string message = std::string(what) + " = " + std::string(value);
    if (!where.empty()) message += " in " + std::string(where);
    return Error(message + ": must be " + std::string(allowed));
}

}  // namespace raylign::detail
