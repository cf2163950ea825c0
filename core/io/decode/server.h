#pragma once

#include <sys/types.h>

#include <string>

#include "core/io/decode/decoder.h"
#include "core/io/decode/packets.h"

namespace raylign::detail {

/// The request as it travels, and back.
[[nodiscard]] std::string packed_request(const DecodeRequest& request);
[[nodiscard]] DecodeRequest unpacked_request(std::string_view bytes, std::string& working_folder);

/// How a decoder's process ended, in words.
struct DecoderEnd {
    int status = 0;  ///< as waitpid gives it
    bool is_overdue = false;
    std::string said;  ///< the beginning of what it wrote to stdout and stderr
};
[[nodiscard]] std::string packed_end(const DecoderEnd& end);
[[nodiscard]] std::string death_text(std::string_view packed, const DecodeRequest& request);

/// Forks a process for every request that arrives at `control`, watches over it and tells how it ended. Ends when the
/// other end of `control` is closed, and all decoders with it.
[[noreturn]] void serve_decoders(Descriptor control);

/// The decoder's process.
[[noreturn]] void run_decoder(std::string_view packed, Descriptor reply, Descriptor output, pid_t server);

}  // namespace raylign::detail
