#pragma once

#include <ostream>
#include <streambuf>
#include <string>

namespace raylign::detail::apps {

/// While it lives, what goes to `stream` goes to a file descriptor with control characters shown (see plain_page):
/// names and texts of files never reach a terminal raw, whoever prints them. On flush, and by the megabyte.
class PlainOutput : public std::streambuf {
public:
    PlainOutput(std::ostream& stream, int descriptor);
    ~PlainOutput() override;
    PlainOutput(const PlainOutput&) = delete;
    PlainOutput& operator=(const PlainOutput&) = delete;

    /// Why the last writing failed, as errno; 0 = it did not.
    [[nodiscard]] int failure() const { return failure_; }

protected:
    int_type overflow(int_type character) override;
    std::streamsize xsputn(const char* text, std::streamsize count) override;
    int sync() override;

private:
    std::ostream& stream_;
    std::streambuf* before_;
    int descriptor_;
    std::string waiting_;
    int failure_ = 0;
};

/// Standard streams that the caller closed lead nowhere from now on: the first file that is opened does not become one
/// of them, and writing to stdout fails as it should.
void hold_standard_streams();

}  // namespace raylign::detail::apps
