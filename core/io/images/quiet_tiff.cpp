#include "core/io/images/quiet_tiff.h"

#include <array>
#include <cstdarg>
#include <cstdio>

namespace raylign::detail {
namespace {

// A handler is told neither the file nor anything of its caller's: only the thread tells whose fault it is.
thread_local std::string* fault_of_this_thread = nullptr;

void keep_tiff_fault(const char*, const char* format, std::va_list arguments) {
    if (fault_of_this_thread == nullptr) return;
    std::array<char, 200> text{};
    (void)std::vsnprintf(text.data(), text.size(), format, arguments);
    *fault_of_this_thread = text.data();
}

}  // namespace

QuietTiff::QuietTiff()
    : outer_fault_(fault_of_this_thread),
      warning_(TIFFSetWarningHandler(nullptr)),
      error_(TIFFSetErrorHandler(&keep_tiff_fault)) {
    fault_of_this_thread = &fault_;
}

QuietTiff::~QuietTiff() {
    fault_of_this_thread = outer_fault_;
    TIFFSetWarningHandler(warning_);
    TIFFSetErrorHandler(error_);
}

std::string QuietTiff::reason() const { return fault_.empty() ? "" : " (libtiff: " + fault_ + ")"; }

}  // namespace raylign::detail
