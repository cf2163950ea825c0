#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace raylign::detail {

/// A file descriptor, closed with the object.
class Descriptor {
public:
    Descriptor() = default;
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(number_, other.number_);
        return *this;
    }
    ~Descriptor();

    [[nodiscard]] int number() const { return number_; }
    [[nodiscard]] bool is_open() const { return number_ >= 0; }
    [[nodiscard]] int release() { return std::exchange(number_, -1); }

private:
    int number_ = -1;
};

/// Two ends of a socket whose packets arrive whole and in order, closed on exec; both closed where there is none to be
/// had.
[[nodiscard]] std::pair<Descriptor, Descriptor> packet_sockets();

inline constexpr std::size_t kMostPacketBytes = 65536;  // any system's socket buffer holds several

enum class PacketKind : std::uint8_t {
    request,   ///< to the server: decode a file; brings the socket for the rest
    message,   ///< from the decoder: a few bytes
    bulk,      ///< from the decoder: a piece of many bytes
    question,  ///< from the decoder: shall it go on?
    consent,   ///< to the decoder: it shall
    finished,  ///< from the decoder: all was said
    failure,   ///< from the decoder: an Error
    ended,     ///< from the server: how the decoder's process ended
    no_fork,   ///< from the server: there is no process to be had
};

enum class Sending { wait, now_or_never };

/// False with errno where the other end is gone, or (now_or_never) its buffer full. `passed`: a descriptor that goes
/// with it; -1 = none. Raises no SIGPIPE.
[[nodiscard]] bool send_packet(int socket, PacketKind kind, std::span<const std::byte> body, int passed = -1,
                               Sending sending = Sending::wait);
[[nodiscard]] bool send_packet(int socket, PacketKind kind, std::string_view body = {}, int passed = -1,
                               Sending sending = Sending::wait);

struct Packet {
    PacketKind kind{};
    std::size_t bytes = 0;  ///< of the body; more than there was room for: the rest is lost
    Descriptor passed;
};

/// Waits for a packet; its body goes to `room`. None where the other end is gone.
[[nodiscard]] std::optional<Packet> receive_packet(int socket, std::span<std::byte> room);

}  // namespace raylign::detail
