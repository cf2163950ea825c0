#pragma once

#include <iosfwd>
#include <memory>
#include <string>

namespace itk {
class ExceptionObject;
}

namespace raylign::detail {

/// While it lives, ITK, MetaIO, GDCM and HDF5 print nothing: the library's errors are exceptions. What goes to
/// std::cerr meanwhile (MetaIO's only channel for some faults) is kept in text(). It swaps process-wide settings and
/// puts them back, so threads of the caller that write to std::cerr at the same time lose their text.
class QuietItk {
public:
    QuietItk();
    ~QuietItk();
    QuietItk(const QuietItk&) = delete;
    QuietItk& operator=(const QuietItk&) = delete;

    [[nodiscard]] std::string text() const;  ///< on one line

private:
    struct State;
    std::unique_ptr<State> state_;
};

/// ITK's description of a failure on one line.
[[nodiscard]] std::string reason_of(const itk::ExceptionObject& failure);

}  // namespace raylign::detail
