#include "core/base/fault_text.h"

#include <array>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "raylign/error.h"

namespace raylign::detail {
namespace {

/// Names of functions and types, as the standard library and others put them into their messages.
bool speaks_cpp(std::string_view text) {
    constexpr std::array<std::string_view, 11> kMarks = {"std::",           "::_M_", "_M_",  "basic_string",
                                                         "vector::",        "stoi",  "stod", "stoul",
                                                         "[json.exception", "bad_",  "regex"};
    for (const std::string_view mark : kMarks) {
        if (text.find(mark) != std::string_view::npos) return true;
    }
    return text.size() < 12;  // "map::at", "stol": no sentence
}

}  // namespace

std::string fault_text(const std::exception& failure) {
    if (dynamic_cast<const Error*>(&failure) != nullptr) return failure.what();
    if (dynamic_cast<const std::bad_alloc*>(&failure) != nullptr ||
        dynamic_cast<const std::length_error*>(&failure) != nullptr) {
        return "not enough memory";
    }
    if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&failure)) {
        return file->path1().string() + " cannot be used: " + file->code().message();
    }
    if (const auto* system = dynamic_cast<const std::system_error*>(&failure)) {
        return "the system refuses: " + system->code().message();
    }
    const std::string text = failure.what();
    if (!speaks_cpp(text)) return text;
    return "a fault that raylign did not foresee (please report it with the command and its input files)";
}

}  // namespace raylign::detail
