#include "core/io/decode/server.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <vector>

#include "core/io/decode/pack.h"

namespace raylign::detail {
namespace {

using ServerClock = std::chrono::steady_clock;

/// A decoder at work, or one whose end is still to be told.
struct DecoderJob {
    pid_t process = -1;
    Descriptor reply;   ///< the caller's socket
    Descriptor output;  ///< what the decoder prints
    ServerClock::time_point deadline;
    DecoderEnd end;
    bool has_ended = false;
};

extern "C" void wake_up(int) {}

/// The terminal's signals are the program's business; this process ends when its socket closes.
void set_up_signals() {
    struct sigaction action {};
    sigemptyset(&action.sa_mask);
    for (int number = 1; number < NSIG; ++number) {
        const bool is_crash = number == SIGSEGV || number == SIGBUS || number == SIGFPE || number == SIGILL ||
                              number == SIGABRT || number == SIGTRAP || number == SIGSYS;
        action.sa_handler = is_crash ? SIG_DFL : number == SIGCHLD ? &wake_up : SIG_IGN;
        sigaction(number, &action, nullptr);  // fails for SIGKILL, SIGSTOP and the C library's own
    }
    sigset_t blocked;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGCHLD);  // arrives within ppoll only
    sigprocmask(SIG_SETMASK, &blocked, nullptr);
}

/// Nobody may wait for a pipe or a lock that only this process still holds.
Descriptor close_all_others(Descriptor control) {
    const int nothing = ::open("/dev/null", O_RDWR);
    for (int stream = 0; stream <= 2; ++stream) ::dup2(nothing, stream);
    constexpr int kControl = 3;
    if (control.number() == kControl) {
        (void)::fcntl(kControl, F_SETFD, FD_CLOEXEC);
    } else {
        (void)::dup3(control.number(), kControl, O_CLOEXEC);
        (void)control.release();
    }
    if (::close_range(kControl + 1, ~0U, 0) != 0) {  // Linux before 5.9
        const long most = std::min(::sysconf(_SC_OPEN_MAX), 65536L);
        for (int number = kControl + 1; number < most; ++number) ::close(number);
    }
    return Descriptor(kControl);
}

void read_output(DecoderJob& job) {
    constexpr std::size_t kMostKept = 2000;
    std::array<char, 4096> piece{};
    for (ssize_t count; (count = ::read(job.output.number(), piece.data(), piece.size())) != 0;) {
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return;
        const std::size_t room = kMostKept - std::min(kMostKept, job.end.said.size());
        job.end.said.append(piece.data(), std::min(room, static_cast<std::size_t>(count)));
    }
    job.output = Descriptor();
}

void start_job(const Descriptor& control, std::vector<DecoderJob>& jobs) {
    std::vector<std::byte> body(kMostPacketBytes);
    std::optional<Packet> packet = receive_packet(control.number(), body);
    if (!packet) {  // the program is gone
        for (const DecoderJob& job : jobs) ::kill(job.process, SIGKILL);
        ::_exit(0);
    }
    if (!packet->passed.is_open()) return;
    const std::string_view bytes(reinterpret_cast<const char*>(body.data()), packet->bytes);
    std::string ignored;
    const double time_s = unpacked_request(bytes, ignored).limits.time_s;
    std::array<int, 2> pipe_ends{-1, -1};
    const bool has_pipe = ::pipe2(pipe_ends.data(), O_CLOEXEC) == 0;
    Descriptor output(pipe_ends[0]), printed(pipe_ends[1]);
    const pid_t server = ::getpid();
    const pid_t process = has_pipe ? ::fork() : -1;
    if (process == 0) {
        jobs.clear();  // closes what belongs to others
        output = Descriptor();
        ::close(control.number());
        run_decoder(bytes, std::move(packet->passed), std::move(printed), server);
    }
    if (process < 0) {
        (void)send_packet(packet->passed.number(), PacketKind::no_fork, std::string_view(), -1, Sending::now_or_never);
        return;
    }
    (void)::fcntl(output.number(), F_SETFL, O_NONBLOCK);
    const auto time = std::chrono::duration_cast<ServerClock::duration>(std::chrono::duration<double>(time_s));
    jobs.push_back({process, std::move(packet->passed), std::move(output), ServerClock::now() + time, {}, false});
}

/// Notes who has ended, and ends who is overdue. Returns the time until the next is, in ms; -1 = never.
int watch(std::vector<DecoderJob>& jobs) {
    std::int64_t wait_ms = -1;
    for (DecoderJob& job : jobs) {
        if (job.has_ended) continue;
        if (::waitpid(job.process, &job.end.status, WNOHANG) == job.process) {
            job.has_ended = true;
            if (job.output.is_open()) read_output(job);
            job.output = Descriptor();
            continue;
        }
        const auto left =
            std::chrono::duration_cast<std::chrono::milliseconds>(job.deadline - ServerClock::now()).count() + 1;
        if (left <= 0 && !job.end.is_overdue) {
            job.end.is_overdue = true;
            ::kill(job.process, SIGKILL);
        }
        if (!job.end.is_overdue) wait_ms = wait_ms < 0 ? left : std::min(wait_ms, left);
    }
    return static_cast<int>(std::min<std::int64_t>(wait_ms, 1000000));
}

void tell_ends(std::vector<DecoderJob>& jobs) {
    std::erase_if(jobs, [](const DecoderJob& job) {
        if (!job.has_ended) return false;
        const bool is_told =
            send_packet(job.reply.number(), PacketKind::ended, packed_end(job.end), -1, Sending::now_or_never);
        return is_told || errno != EAGAIN;  // the caller may be gone: nobody to tell
    });
}

}  // namespace

void serve_decoders(Descriptor given) {
    ::setsid();
    (void)!::chdir("/");  // keeps no file system in use; a decoder goes to the caller's folder
    set_up_signals();
    const Descriptor control = close_all_others(std::move(given));
    std::vector<DecoderJob> jobs;
    sigset_t none;
    sigemptyset(&none);
    for (;;) {
        const int wait_ms = watch(jobs);
        tell_ends(jobs);
        std::vector<pollfd> waits{{control.number(), POLLIN, 0}};
        for (const DecoderJob& job : jobs) {
            waits.push_back(job.has_ended ? pollfd{job.reply.number(), POLLOUT, 0}
                                          : pollfd{job.output.number(), POLLIN, 0});
        }
        const timespec wait{wait_ms / 1000, wait_ms % 1000 * 1000000L};
        if (::ppoll(waits.data(), waits.size(), wait_ms < 0 ? nullptr : &wait, &none) < 0) continue;
        for (std::size_t i = 0; i < jobs.size(); ++i) {
            if (waits[i + 1].revents != 0 && jobs[i].output.is_open()) read_output(jobs[i]);
        }
        if (waits.front().revents != 0) start_job(control, jobs);
    }
}

}  // namespace raylign::detail
