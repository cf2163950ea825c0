// Without MPI: always alone.

#include <cstdlib>

#include "apps/study/ranks.h"
#include "apps/study/ranks_started.h"
#include "core/base/error.h"

namespace raylign::detail::apps {

std::unique_ptr<Ranks> Ranks::join() {
    if (launched_processes() < 2) return nullptr;
    throw Error(
        "started by mpirun or srun as several processes, but this build has no MPI: install libopenmpi-dev and "
        "build again",
        ErrorKind::unavailable);
}

Ranks::~Ranks() = default;
int Ranks::rank() const { return 0; }
int Ranks::size() const { return 1; }
void Ranks::send(int, const std::string&) {}
std::optional<RankMessage> Ranks::poll() { return std::nullopt; }
RankMessage Ranks::wait() { return {}; }
std::vector<std::string> Ranks::exchange(const std::string& text) { return {text}; }
void Ranks::abort(int exit_code) { std::_Exit(exit_code); }

}  // namespace raylign::detail::apps
