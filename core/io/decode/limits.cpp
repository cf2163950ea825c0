#include "core/io/decode/limits.h"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>

#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// Bytes of memory of the machine, or of the container (Linux, cgroup v2), whichever has less.
double machine_bytes() {
    const auto machine = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
    double container = machine;
    std::ifstream("/sys/fs/cgroup/memory.max") >> container;  // the word "max" sets 0
    return container > 0 ? std::min(machine, container) : machine;
}

/// What deflate can make of a byte at most is 1032.
constexpr double kBytesPerByte = 2200, kLeastBytes = 1 << 30;
constexpr double kLeast_s = 120, kBytesPer_s = 1e6;

}  // namespace

DecodeLimits limits_for(const std::filesystem::path& path) {
    static const double machine = machine_bytes();
    std::error_code unknown;
    const std::uintmax_t size = std::filesystem::file_size(path, unknown);
    const std::string extension = lower_case(path.extension().string());
    const bool is_detached = extension == ".mhd" || extension == ".nhdr" || extension == ".hdr" || unknown;
    const double file = is_detached ? machine / 2 : static_cast<double>(size);
    const double memory = std::min(machine, kLeastBytes + kBytesPerByte * file);
    return {kLeast_s + file / kBytesPer_s, static_cast<std::size_t>(memory)};
}

}  // namespace raylign::detail
