#include "apps/shared/lines.h"

#include <cstdarg>
#include <cstdio>

namespace raylign::detail::apps {

std::string format(const char* pattern, ...) {
    va_list arguments, again;
    va_start(arguments, pattern);
    va_copy(again, arguments);
    const int length = std::vsnprintf(nullptr, 0, pattern, arguments);
    va_end(arguments);
    std::string text(length > 0 ? static_cast<std::size_t>(length) : 0, '\0');
    std::vsnprintf(text.data(), text.size() + 1, pattern, again);
    va_end(again);
    return text;
}

std::string line(const std::string& label, const std::string& text, int width) {
    return format("  %-*s ", width - 1, label.c_str()) + text + "\n";
}

}  // namespace raylign::detail::apps
