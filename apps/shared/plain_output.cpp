#include "apps/shared/plain_output.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>

#include "core/base/plain_text.h"

namespace raylign::detail::apps {
namespace {

constexpr std::size_t kMostWaiting = 1 << 20;

/// Returns errno; 0 = all is written.
int write_to(int descriptor, std::string_view text) {
    while (!text.empty()) {
        const ssize_t written = ::write(descriptor, text.data(), text.size());
        if (written < 0 && errno != EINTR) return errno;
        if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

}  // namespace

PlainOutput::PlainOutput(std::ostream& stream, int descriptor)
    : stream_(stream), before_(stream.rdbuf(this)), descriptor_(descriptor) {}

PlainOutput::~PlainOutput() {
    PlainOutput::sync();
    stream_.rdbuf(before_);
}

PlainOutput::int_type PlainOutput::overflow(int_type character) {
    if (traits_type::eq_int_type(character, traits_type::eof())) return traits_type::not_eof(character);
    const char one = traits_type::to_char_type(character);
    return xsputn(&one, 1) == 1 ? character : traits_type::eof();
}

std::streamsize PlainOutput::xsputn(const char* text, std::streamsize count) {
    waiting_.append(text, static_cast<std::size_t>(count));
    // Only whole lines: a character of several bytes may not have arrived whole.
    if (waiting_.size() > kMostWaiting && waiting_.back() == '\n' && sync() != 0) return 0;
    return count;
}

int PlainOutput::sync() {
    const int failed = write_to(descriptor_, plain_page(waiting_));
    waiting_.clear();
    if (failed != 0) failure_ = failed;
    return failed == 0 ? 0 : -1;
}

void hold_standard_streams() {
    for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
        // It gets the lowest number that is free, which is this one. Read-only: writing to it fails.
        if (::fcntl(stream, F_GETFD) < 0) (void)::open("/dev/null", O_RDONLY);
    }
}

}  // namespace raylign::detail::apps
