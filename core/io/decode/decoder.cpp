#include "core/io/decode/decoder.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cerrno>
#include <mutex>

#include "core/base/error.h"
#include "core/io/decode/pack.h"
#include "core/io/decode/server.h"
#include "raylign/io/decoding.h"

namespace raylign {
using namespace detail;
namespace detail {
namespace {

// The server belongs to the process, as its threads and descriptors do: whoever reads finds it here.
constinit std::mutex starting;
constinit std::atomic<int> control_socket{-1};  // the number stays the same when a new server replaces a dead one
constinit std::atomic<unsigned> servers_started{0};
constinit std::atomic<Decoding> wanted_decoding{Decoding::own_process};
constinit std::atomic<uid_t> started_by{0};

struct ServerGone {};
struct NoProcess {};

/// The server is nobody's child, so that no wait() of the program meets it.
Descriptor fork_server() {
    auto [ours, its] = packet_sockets();
    if (!ours.is_open()) return {};
    const pid_t between = ::fork();
    if (between < 0) return {};
    if (between == 0) {
        if (const pid_t server = ::fork(); server != 0) ::_exit(server < 0 ? 1 : 0);
        ours = Descriptor();
        wanted_decoding = Decoding::in_process;  // a decoder that reads another file does so itself
        serve_decoders(std::move(its));
    }
    its = Descriptor();
    int status = 0;  // stays 0 where another waits for all children, or none may be waited for
    while (::waitpid(between, &status, 0) < 0 && errno == EINTR) {
    }
    return status == 0 ? std::move(ours) : Descriptor();
}

/// Makes sure that a server runs which was started after the first `dead` ones. False where that cannot be.
bool start_server(unsigned dead) {
    const std::lock_guard lock(starting);
    if (servers_started > dead) return true;
    Descriptor fresh = fork_server();
    if (!fresh.is_open()) return false;
    if (control_socket < 0) {
        control_socket = fresh.release();
    } else if (::dup3(fresh.number(), control_socket, O_CLOEXEC) < 0) {
        return false;
    }
    started_by = ::geteuid();
    ++servers_started;
    return true;
}

}  // namespace

void DecoderReply::message(std::string_view bytes) {
    // Its length goes ahead: it may need several packets.
    if (!send_packet(socket_, PacketKind::message, Packer().add(bytes.size()).bytes())) ::_exit(0);  // nobody listens
    bulk(std::as_bytes(std::span(bytes)));
}

void DecoderReply::bulk(std::span<const std::byte> bytes) {
    for (std::size_t done = 0; done < bytes.size(); done += kMostPacketBytes) {
        const std::size_t count = std::min(kMostPacketBytes, bytes.size() - done);
        if (!send_packet(socket_, PacketKind::bulk, bytes.subspan(done, count))) ::_exit(0);
    }
}

void DecoderReply::wait_for_consent() {
    std::array<std::byte, 1> ignored;
    if (!send_packet(socket_, PacketKind::question) || !receive_packet(socket_, ignored)) ::_exit(0);
}

std::size_t DecodedStream::next(PacketKind kind, std::span<std::byte> room) {
    std::array<std::byte, kMostPacketBytes> other;
    const bool is_small = room.size() < other.size();
    const std::optional<Packet> packet = receive_packet(socket_, is_small ? std::span<std::byte>(other) : room);
    if (!packet) throw ServerGone{};
    const std::span<std::byte> body = is_small ? std::span<std::byte>(other) : room;
    const std::string_view text(reinterpret_cast<const char*>(body.data()), std::min(packet->bytes, body.size()));
    if (packet->kind == PacketKind::no_fork) throw NoProcess{};
    if (packet->kind == PacketKind::ended) throw Error(death_text(text, request_));
    if (packet->kind == PacketKind::failure) {
        Unpacker from(text);
        const auto error_kind = from.number<ErrorKind>();
        throw Error(from.text(), error_kind);
    }
    if (packet->kind != kind || packet->bytes > room.size()) {
        throw Error("the reader of " + request_.path.string() + " gives no sensible answer: damaged file?");
    }
    if (is_small) std::ranges::copy(body.first(packet->bytes), room.begin());
    return packet->bytes;
}

std::string DecodedStream::message() {
    std::array<std::byte, sizeof(std::size_t)> length{};
    (void)next(PacketKind::message, length);
    std::size_t left = std::bit_cast<std::size_t>(length);
    std::string bytes;
    while (left > 0) {  // memory is taken as the bytes arrive, not on a claim
        const std::size_t count = std::min(kMostPacketBytes, left), begin = bytes.size();
        bytes.resize(begin + count);
        bulk(std::as_writable_bytes(std::span(bytes)).subspan(begin));
        left -= count;
    }
    return bytes;
}

void DecodedStream::bulk(std::span<std::byte> bytes) {
    while (!bytes.empty()) {
        const std::size_t count = std::min(kMostPacketBytes, bytes.size());
        if (next(PacketKind::bulk, bytes.first(count)) != count) {
            throw Error("the reader of " + request_.path.string() + " gives no sensible answer: damaged file?");
        }
        bytes = bytes.subspan(count);
    }
}

void DecodedStream::consent() {
    std::array<std::byte, 1> none;
    (void)next(PacketKind::question, std::span(none).first(0));
    (void)send_packet(socket_, PacketKind::consent);  // where the decoder has died meanwhile, the next packet says so
}

void DecodedStream::finish() {
    std::array<std::byte, 1> none;
    (void)next(PacketKind::finished, std::span(none).first(0));
}

bool decode(const DecodeRequest& request, const std::function<void(DecodedStream&)>& read) {
    const std::string packed = packed_request(request);
    if (wanted_decoding == Decoding::in_process || packed.size() > kMostPacketBytes) return false;
    if (servers_started == 0 && !start_server(0)) return false;
    for (int attempt = 0; attempt < 2; ++attempt) {
        const unsigned server = servers_started;
        // Another user's rights are another program's: what he may not read, the server might.
        if (started_by != ::geteuid()) return false;
        auto [ours, its] = packet_sockets();
        if (!ours.is_open()) return false;
        try {
            if (!send_packet(control_socket, PacketKind::request, packed, its.number())) throw ServerGone{};
            its = Descriptor();
            DecodedStream stream(ours.number(), request);
            read(stream);
            stream.finish();
            return true;
        } catch (const NoProcess&) {
            return false;
        } catch (const ServerGone&) {
            if (!start_server(server)) return false;
        }
    }
    throw Error("the reader of " + request.path.string() + " was killed twice, with all that belongs to it");
}

}  // namespace detail

void start_decoding_server() {
    if (wanted_decoding == Decoding::own_process && servers_started == 0) (void)start_server(0);
}

void set_decoding(Decoding how) { wanted_decoding = how; }

}  // namespace raylign
