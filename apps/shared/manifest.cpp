#include "apps/shared/manifest.h"

#include "apps/shared/machine.h"
#include "core/base/clock.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {

Json machine_json() {
    const Machine machine = this_machine();
    return {{"host", machine.host},     {"processor", machine.processor},
            {"cores", machine.cores},   {"memory_bytes", machine.memory_bytes},
            {"system", machine.system}, {"compiler", machine.compiler}};
}

InputHashes hash_inputs(const std::vector<std::filesystem::path>& files) {
    const auto begin = Clock::now();
    InputHashes hashes;
    for (const std::filesystem::path& file : files) hashes.files.push_back({file.string(), sha256_of_file(file)});
    hashes.time_s = seconds_since(begin);
    return hashes;
}

Json inputs_json(const InputHashes& hashes) {
    Json list = Json::array();
    for (const HashedFile& file : hashes.files) list.push_back({{"path", file.path}, {"sha256", file.sha256}});
    return list;
}

Json backend_json(const BackendInfo& info) {
    return {{"name", info.name},
            {"summary", info.summary},
            {"device", info.device},
            {"threads", info.threads},
            {"instruction_set", info.instruction_set}};
}

Json backend_json(const BackendInfo& info, const std::vector<BackendStatus>& passed_over) {
    Json backend = backend_json(info);
    backend.erase("summary");
    backend["storage"] = info.storage;
    backend["interpolation"] = info.interpolation;
    backend["solver"] = info.solver;
    backend["timing"] = info.timing;
    backend["passed_over"] = passed_over_json(passed_over);
    return backend;
}

Json passed_over_json(const std::vector<BackendStatus>& others) {
    Json list = Json::array();
    for (const BackendStatus& other : others) list.push_back({{"name", other.name}, {"reason", other.reason}});
    return list;
}

}  // namespace raylign::detail::apps
