#include "core/io/decode/packets.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace raylign::detail {

Descriptor::~Descriptor() {
    if (number_ >= 0) ::close(number_);
}

std::pair<Descriptor, Descriptor> packet_sockets() {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) return {};
    return {Descriptor(ends[0]), Descriptor(ends[1])};
}

bool send_packet(int socket, PacketKind kind, std::span<const std::byte> body, int passed, Sending sending) {
    std::array<iovec, 2> parts{};
    parts[0] = {&kind, sizeof kind};
    parts[1] = {const_cast<std::byte*>(body.data()), body.size()};  // sendmsg only reads
    msghdr message{};
    message.msg_iov = parts.data();
    message.msg_iovlen = parts.size();
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
    if (passed >= 0) {
        message.msg_control = control.data();
        message.msg_controllen = control.size();
        cmsghdr* header = CMSG_FIRSTHDR(&message);
        header->cmsg_level = SOL_SOCKET;
        header->cmsg_type = SCM_RIGHTS;
        header->cmsg_len = CMSG_LEN(sizeof(int));
        std::memcpy(CMSG_DATA(header), &passed, sizeof passed);
    }
    const int flags = MSG_NOSIGNAL | (sending == Sending::now_or_never ? MSG_DONTWAIT : 0);
    ssize_t sent = 0;
    do {
        sent = ::sendmsg(socket, &message, flags);
    } while (sent < 0 && errno == EINTR);
    return sent >= 0;
}

bool send_packet(int socket, PacketKind kind, std::string_view body, int passed, Sending sending) {
    return send_packet(socket, kind, std::as_bytes(std::span(body)), passed, sending);
}

std::optional<Packet> receive_packet(int socket, std::span<std::byte> room) {
    Packet packet;
    std::array<iovec, 2> parts{};
    parts[0] = {&packet.kind, sizeof packet.kind};
    parts[1] = {room.data(), room.size()};
    msghdr message{};
    message.msg_iov = parts.data();
    message.msg_iovlen = parts.size();
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    ssize_t received = 0;
    do {
        received = ::recvmsg(socket, &message, MSG_CMSG_CLOEXEC | MSG_TRUNC);
    } while (received < 0 && errno == EINTR);
    if (received <= 0) return std::nullopt;
    packet.bytes = static_cast<std::size_t>(received) - sizeof packet.kind;
    const cmsghdr* header = CMSG_FIRSTHDR(&message);
    if (header != nullptr && header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_RIGHTS) {
        int passed = -1;
        std::memcpy(&passed, CMSG_DATA(header), sizeof passed);
        packet.passed = Descriptor(passed);
    }
    return packet;
}

}  // namespace raylign::detail
