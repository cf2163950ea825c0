#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace raylign::detail::apps {

struct RankMessage {
    int from = 0;
    std::string text;
};

/// The processes that mpirun or srun started together, and text messages between them. Messages from one process to
/// another arrive in order. Used from one thread.
class Ranks {
public:
    /// The processes of this run; null where it runs alone. Throws Error, kind unavailable, where several were started
    /// and this build has no MPI: each would do all the work and write the same files.
    [[nodiscard]] static std::unique_ptr<Ranks> join();

    /// Leaves the group; while an exception is in flight it ends all processes instead, which would wait for ever.
    ~Ranks();
    Ranks(const Ranks&) = delete;
    Ranks& operator=(const Ranks&) = delete;

    [[nodiscard]] int rank() const;
    [[nodiscard]] int size() const;
    void send(int to, const std::string& text);
    [[nodiscard]] std::optional<RankMessage> poll();  ///< the next message, if one has arrived
    [[nodiscard]] RankMessage wait();
    /// Everybody's text, by rank, on every rank. All must call it.
    [[nodiscard]] std::vector<std::string> exchange(const std::string& text);
    /// Ends all processes at once.
    [[noreturn]] void abort(int exit_code);

private:
    Ranks();
};

}  // namespace raylign::detail::apps
