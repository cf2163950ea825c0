#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <new>

#include "core/base/fault_text.h"
#include "core/base/plain_text.h"
#include "core/io/decode/pack.h"
#include "core/io/decode/server.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

/// Private writable memory that the process has by now: what RLIMIT_DATA counts (Linux; /proc/self/statm).
std::size_t data_bytes() {
    std::array<std::size_t, 6> pages{};
    std::ifstream statm("/proc/self/statm");
    for (std::size_t& count : pages) statm >> count;
    return pages[5] * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

void limit(int what, rlim_t most) {
    rlimit now{};
    if (::getrlimit(what, &now) != 0 || now.rlim_cur <= most) return;
    now.rlim_cur = most;
    ::setrlimit(what, &now);
}

void fence_in(const DecodeLimits& limits, pid_t server) {
    // Nobody waits for the answer when the server is gone.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != server) ::_exit(1);
    limit(RLIMIT_CORE, 0);
    if (!kHasShadowMemory && limits.memory_bytes > 0) limit(RLIMIT_DATA, data_bytes() + limits.memory_bytes);
}

void fail(int socket, const std::string& what, ErrorKind kind) {
    constexpr std::size_t kMost = kMostPacketBytes / 2;
    (void)send_packet(socket, PacketKind::failure, Packer().add(kind).add(what.substr(0, kMost)).bytes());
}

std::string signal_text(int number) {
    switch (number) {
        case SIGSEGV:
            return "SIGSEGV";
        case SIGABRT:
            return "SIGABRT";
        case SIGBUS:
            return "SIGBUS";
        case SIGFPE:
            return "SIGFPE";
        case SIGILL:
            return "SIGILL";
        case SIGXFSZ:
            return "SIGXFSZ";
        case SIGKILL:
            return "SIGKILL: was memory short?";
        default:
            return "signal " + std::to_string(number);
    }
}

}  // namespace

std::string packed_request(const DecodeRequest& request) {
    std::error_code ignored;  // relative names then fail in the decoder, with the name
    return Packer()
        .add(reinterpret_cast<std::uintptr_t>(request.decoder))
        .add(request.limits.time_s)
        .add(request.limits.memory_bytes)
        .add(request.path.string())
        .add(request.arguments)
        .add(std::filesystem::current_path(ignored).string())
        .bytes();
}

DecodeRequest unpacked_request(std::string_view bytes, std::string& working_folder) {
    Unpacker from(bytes);
    DecodeRequest request;
    request.decoder = reinterpret_cast<Decoder>(from.number<std::uintptr_t>());
    request.limits.time_s = from.number<double>();
    request.limits.memory_bytes = from.number<std::size_t>();
    request.path = from.text();
    request.arguments = from.text();
    working_folder = from.text();
    return request;
}

std::string packed_end(const DecoderEnd& end) {
    return Packer().add(end.status).add(end.is_overdue).add(end.said).bytes();
}

std::string death_text(std::string_view packed, const DecodeRequest& request) {
    Unpacker from(packed);
    const auto status = from.number<int>();
    const bool is_overdue = from.number<bool>();
    const std::string said = plain_text(trimmed(from.text()));
    std::string text = "the reader of " + request.path.string();
    if (is_overdue) {
        text += " did not end within " + number_text(request.limits.time_s) + " s: damaged file?";
    } else if (WIFSIGNALED(status)) {
        text += " died (" + signal_text(WTERMSIG(status)) + "): damaged file? Please report it";
    } else {
        text += " ended without an answer (exit code " + std::to_string(WEXITSTATUS(status)) +
                "): damaged file? Please report it";
    }
    return said.empty() ? text : text + ". It said: " + said;
}

void run_decoder(std::string_view packed, Descriptor reply, Descriptor output, pid_t server) {
    std::string working_folder;
    const DecodeRequest request = unpacked_request(packed, working_folder);
    fence_in(request.limits, server);
    for (int stream = 1; stream <= 2; ++stream) ::dup2(output.number(), stream);
    output = Descriptor();
    if (!working_folder.empty()) (void)!::chdir(working_folder.c_str());
    std::signal(SIGCHLD, SIG_DFL);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    const int socket = reply.number();
    try {
        DecoderReply answer(socket);
        request.decoder(request.path, request.arguments, answer);
        (void)send_packet(socket, PacketKind::finished);
    } catch (const Error& failure) {
        fail(socket, failure.what(), failure.kind());
    } catch (const std::exception& failure) {
        fail(socket, request.path.string() + ": " + fault_text(failure), ErrorKind::input);
    } catch (...) {
        fail(socket, request.path.string() + " cannot be read: its reader failed without a word", ErrorKind::input);
    }
    ::_exit(0);
}

}  // namespace raylign::detail
