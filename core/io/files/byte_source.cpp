#include "core/io/files/byte_source.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/io/files/temporary_file.h"

namespace raylign::detail {

struct ByteSource::Inflater {
    Inflater() : packed(1 << 18) {
        constexpr int kZlibOrGzip = 15 + 32;
        if (inflateInit2(&stream, kZlibOrGzip) != Z_OK) throw Error("zlib cannot be started");
    }
    ~Inflater() { inflateEnd(&stream); }
    Inflater(const Inflater&) = delete;
    Inflater& operator=(const Inflater&) = delete;

    std::vector<std::byte> packed;
    z_stream stream{};
};

ByteSource::ByteSource(std::filesystem::path path, std::uint64_t begin, Packing packing)
    : path_(std::move(path)), file_(path_, std::ios::binary) {
    if (!file_) throw Error(path_.string() + " cannot be read: " + system_reason(errno));
    file_.seekg(static_cast<std::streamoff>(begin));
    if (packing == Packing::deflate) inflater_ = std::make_unique<Inflater>();
}

ByteSource::~ByteSource() = default;

std::size_t ByteSource::read(std::span<std::byte> to) { return inflater_ ? read_packed(to) : read_raw(to); }

std::size_t ByteSource::read_raw(std::span<std::byte> to) {
    file_.read(reinterpret_cast<char*>(to.data()), static_cast<std::streamsize>(to.size()));
    if (file_.bad()) throw Error(path_.string() + " cannot be read: " + system_reason(errno));
    return static_cast<std::size_t>(file_.gcount());
}

bool ByteSource::refill() {
    z_stream& stream = inflater_->stream;
    if (stream.avail_in > 0) return true;
    const std::size_t count = read_raw(inflater_->packed);
    stream.next_in = reinterpret_cast<Bytef*>(inflater_->packed.data());
    stream.avail_in = static_cast<uInt>(count);
    return count > 0;
}

std::size_t ByteSource::read_packed(std::span<std::byte> to) {
    constexpr std::size_t kMost = 1 << 30;  // zlib counts in 32 bits
    z_stream& stream = inflater_->stream;
    std::size_t done = 0;
    while (done < to.size() && refill()) {
        const std::size_t wanted = std::min(to.size() - done, kMost);
        stream.next_out = reinterpret_cast<Bytef*>(to.data() + done);
        stream.avail_out = static_cast<uInt>(wanted);
        const int status = inflate(&stream, Z_NO_FLUSH);
        done += wanted - stream.avail_out;
        if (status == Z_STREAM_END) {
            inflateReset(&stream);
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            throw Error(path_.string() + " is truncated or damaged: its packed bytes are no deflate stream (zlib: " +
                        (stream.msg == nullptr ? "dictionary needed" : stream.msg) + ")");
        }
    }
    return done;
}

bool ByteSource::skip(std::uint64_t bytes) {
    if (!inflater_) return static_cast<bool>(file_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur));
    std::vector<std::byte> block(1 << 16);
    while (bytes > 0) {
        const std::size_t wanted = static_cast<std::size_t>(std::min<std::uint64_t>(block.size(), bytes));
        if (read({block.data(), wanted}) != wanted) return false;
        bytes -= wanted;
    }
    return true;
}

bool is_gzip(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 2> mark{};
    return file.read(mark.data(), 2) && mark[0] == '\x1f' && mark[1] == '\x8b';
}

}  // namespace raylign::detail
