#pragma once

#include <tiffio.h>

#include <string>

namespace raylign::detail {

/// libtiff's handlers print; they are process-wide until 4.5, so they are replaced for as long as this lives. Keeps
/// what libtiff last called an error on this thread.
class QuietTiff {
public:
    QuietTiff();
    ~QuietTiff();
    QuietTiff(const QuietTiff&) = delete;
    QuietTiff& operator=(const QuietTiff&) = delete;

    /// " (libtiff: ...)"; "" where it said nothing.
    [[nodiscard]] std::string reason() const;

private:
    std::string fault_;
    std::string* outer_fault_;
    TIFFErrorHandler warning_, error_;
};

}  // namespace raylign::detail
