#include "backends/gl/program_cache.h"

#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>

namespace raylign::detail::gl {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "raylign program 1\n";
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 28;

/// FNV-1a: finds damage, not malice; the folder is the user's own.
std::uint64_t checksum(std::string_view bytes) {
    std::uint64_t sum = 14695981039346656037ULL;
    for (const char c : bytes) sum = (sum ^ static_cast<unsigned char>(c)) * 1099511628211ULL;
    return sum;
}

fs::path file_of(const fs::path& folder, const ProgramIdentity& identity) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    const std::uint64_t sum = checksum(identity);
    std::string name;
    for (int shift = 60; shift >= 0; shift -= 4) name += kDigits[sum >> shift & 15];
    return folder / name;
}

template <class Value>
void append(std::string& out, Value value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Takes a value off the front; false where there is too little.
template <class Value>
bool take(std::string_view& in, Value& value) {
    if (in.size() < sizeof value) return false;
    std::memcpy(&value, in.data(), sizeof value);
    in.remove_prefix(sizeof value);
    return true;
}

/// magic, checksum of the rest, length of the identity, identity, format, bytes
std::string content_of(const ProgramIdentity& identity, const ProgramBinary& binary) {
    std::string rest;
    append(rest, static_cast<std::uint64_t>(identity.size()));
    rest += identity;
    append(rest, static_cast<std::uint32_t>(binary.format));
    rest.append(binary.bytes.begin(), binary.bytes.end());
    std::string content(kMagic);
    append(content, checksum(rest));
    return content + rest;
}

std::optional<ProgramBinary> parse(std::string_view content, const ProgramIdentity& identity) {
    std::uint64_t sum = 0, length = 0;
    if (!content.starts_with(kMagic)) return {};
    content.remove_prefix(kMagic.size());
    if (!take(content, sum) || sum != checksum(content)) return {};
    if (!take(content, length) || length > content.size() || content.substr(0, length) != identity) return {};
    content.remove_prefix(length);
    std::uint32_t format = 0;
    if (!take(content, format) || content.empty()) return {};
    return ProgramBinary{format, {content.begin(), content.end()}};
}

}  // namespace

fs::path default_program_folder() {
    if (const char* const folder = std::getenv("RAYLIGN_PROGRAM_FOLDER")) return folder;
    if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/') {
        return fs::path(cache) / "raylign" / "programs";
    }
    const char* const home = std::getenv("HOME");
    return home != nullptr && *home == '/' ? fs::path(home) / ".cache" / "raylign" / "programs" : fs::path();
}

std::optional<ProgramBinary> read_program(const fs::path& folder, const ProgramIdentity& identity) {
    const fs::path file = file_of(folder, identity);
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    if (error || size > kMostBytes) return {};
    std::ifstream in(file, std::ios::binary);
    std::string content(static_cast<std::size_t>(size), '\0');
    if (!in.read(content.data(), static_cast<std::streamsize>(size))) return {};
    return parse(content, identity);
}

void keep_program(const fs::path& folder, const ProgramIdentity& identity, const ProgramBinary& binary) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return;
    const fs::path file = file_of(folder, identity);
    fs::path unfinished = file;  // renamed once whole: others read at the same time
    unfinished += "." + std::to_string(::getpid());
    const std::string content = content_of(identity, binary);
    std::ofstream out(unfinished, std::ios::binary);
    out.write(content.data(), static_cast<std::streamsize>(content.size()));
    out.close();
    if (out) fs::rename(unfinished, file, error);
    if (!out || error) fs::remove(unfinished, error);
}

}  // namespace raylign::detail::gl
