#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>

namespace raylign::detail {

enum class Packing { none, deflate };

/// The bytes of a file from `begin` on, one after another; unpacked where they are packed by deflate (zlib or gzip, as
/// several members in a row, too).
class ByteSource {
public:
    ByteSource(std::filesystem::path path, std::uint64_t begin, Packing packing);
    ~ByteSource();
    ByteSource(const ByteSource&) = delete;
    ByteSource& operator=(const ByteSource&) = delete;

    /// Fills as much of `to` as there is and returns how much that was. Throws Error for damaged packing.
    [[nodiscard]] std::size_t read(std::span<std::byte> to);
    /// Returns false where the bytes end before.
    [[nodiscard]] bool skip(std::uint64_t bytes);

private:
    struct Inflater;
    std::size_t read_raw(std::span<std::byte> to);
    std::size_t read_packed(std::span<std::byte> to);
    bool refill();

    std::filesystem::path path_;
    std::ifstream file_;
    std::unique_ptr<Inflater> inflater_;  ///< none: the bytes are not packed
};

/// gzip's mark at the beginning of the file.
[[nodiscard]] bool is_gzip(const std::filesystem::path& path);

}  // namespace raylign::detail
