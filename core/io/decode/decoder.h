#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "core/io/decode/limits.h"
#include "core/io/decode/packets.h"

// Files of others are decoded by libraries of others, in a process of its own for each file: what a damaged file does
// there - a crash, an abort, an endless loop, all memory - is an Error here. docs/hacking.md says how it works.

namespace raylign::detail {

/// The decoder's end: what it says to the process that asked.
class DecoderReply {
public:
    explicit DecoderReply(int socket) : socket_(socket) {}

    /// What belongs together, such as a header: DecodedStream::message gives it back.
    void message(std::string_view bytes);
    /// Many bytes: DecodedStream::bulk takes as many at once, without a copy.
    void bulk(std::span<const std::byte> bytes);
    /// Waits until the other side wants to hear more. Ends the process where it does not.
    void wait_for_consent();

private:
    int socket_;
};

/// A function of the program itself: it runs in another process that was forked earlier, and sees nothing of the
/// caller but these. What it throws is thrown to the caller as an Error with the same words. Within it everything is
/// read in its own process.
using Decoder = void (*)(const std::filesystem::path& path, const std::string& arguments, DecoderReply& reply);

struct DecodeRequest {
    Decoder decoder = nullptr;
    std::filesystem::path path;
    std::string arguments;  ///< some bytes, see Packer
    DecodeLimits limits;
};

/// The caller's end. Throws Error as soon as the decoder failed or died, or says something else.
class DecodedStream {
public:
    DecodedStream(int socket, const DecodeRequest& request) : socket_(socket), request_(request) {}

    [[nodiscard]] std::string message();
    void bulk(std::span<std::byte> bytes);
    /// Answers the decoder's question whether to go on.
    void consent();
    /// Waits until the decoder is done.
    void finish();

private:
    [[nodiscard]] std::size_t next(PacketKind kind, std::span<std::byte> room);

    int socket_;
    const DecodeRequest& request_;
};

/// Runs the decoder in a process of its own while `read` takes what it says, on the caller's thread. Returns false
/// where there is no process to be had (or wanted): nothing was read then, and the caller decodes by itself. Throws
/// what the decoder and `read` throw, and Error where the decoder dies, meets a limit or talks nonsense. May be used
/// from any thread. `read` is called again where the server of these processes was killed meanwhile.
[[nodiscard]] bool decode(const DecodeRequest& request, const std::function<void(DecodedStream&)>& read);

}  // namespace raylign::detail
