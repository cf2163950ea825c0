#pragma once

#include <stdexcept>
#include <string>

namespace raylign {

/// What went wrong, as far as a caller must act differently on it. Apps map it to the exit code (formats.md).
enum class ErrorKind {
    input,        ///< bad input, file or option: exit 2
    unavailable,  ///< a backend or device that cannot run here: exit 3
};

/// The one exception of the library. The message says what, its value, what is allowed, and where:
/// "step_mm = 0 in level 2 of job.json: must be in (0, 10]".
class Error : public std::runtime_error {
public:
    explicit Error(const std::string& message, ErrorKind kind = ErrorKind::input)
        : std::runtime_error(message), kind_(kind) {}

    [[nodiscard]] ErrorKind kind() const noexcept { return kind_; }

private:
    ErrorKind kind_;
};

}  // namespace raylign
