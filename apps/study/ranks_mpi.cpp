// With MPI: the only file that includes it.

#include <mpi.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <thread>

#include "apps/study/ranks.h"
#include "apps/study/ranks_started.h"

namespace raylign::detail::apps {

Ranks::Ranks() { MPI_Init(nullptr, nullptr); }

std::unique_ptr<Ranks> Ranks::join() {
    // Without a launcher MPI_Init would take its time for nothing, and fail where no MPI daemon can start.
    if (!started_by_a_launcher()) return nullptr;
    return std::unique_ptr<Ranks>(new Ranks());
}

Ranks::~Ranks() {
    if (std::uncaught_exceptions() > 0) MPI_Abort(MPI_COMM_WORLD, 2);
    MPI_Finalize();
}

int Ranks::rank() const {
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}

int Ranks::size() const {
    int size = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &size);
    return size;
}

void Ranks::send(int to, const std::string& text) {
    MPI_Send(text.data(), static_cast<int>(text.size()), MPI_CHAR, to, 0, MPI_COMM_WORLD);
}

std::optional<RankMessage> Ranks::poll() {
    int arrived = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, 0, MPI_COMM_WORLD, &arrived, &status);
    if (arrived == 0) return std::nullopt;
    int length = 0;
    MPI_Get_count(&status, MPI_CHAR, &length);
    RankMessage message{status.MPI_SOURCE, std::string(static_cast<std::size_t>(length), '\0')};
    MPI_Recv(message.text.data(), length, MPI_CHAR, message.from, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    return message;
}

RankMessage Ranks::wait() {
    // MPI_Probe would spin on a core that another rank may need.
    for (;;) {
        if (std::optional<RankMessage> message = poll()) return *message;
        std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
}

std::vector<std::string> Ranks::exchange(const std::string& text) {
    const int ranks = size();
    const int length = static_cast<int>(text.size());
    std::vector<int> lengths(ranks), places(ranks);
    MPI_Allgather(&length, 1, MPI_INT, lengths.data(), 1, MPI_INT, MPI_COMM_WORLD);
    int total = 0;
    for (int r = 0; r < ranks; ++r) {
        places[r] = total;
        total += lengths[r];
    }
    std::string all(static_cast<std::size_t>(total), '\0');
    MPI_Allgatherv(text.data(), length, MPI_CHAR, all.data(), lengths.data(), places.data(), MPI_CHAR, MPI_COMM_WORLD);
    std::vector<std::string> texts;
    for (int r = 0; r < ranks; ++r) texts.push_back(all.substr(places[r], lengths[r]));
    return texts;
}

void Ranks::abort(int exit_code) {
    MPI_Abort(MPI_COMM_WORLD, exit_code);
    std::abort();
}

}  // namespace raylign::detail::apps
