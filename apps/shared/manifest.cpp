#include "apps/shared/manifest.h"

#include "apps/shared/machine.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {

Json machine_json() {
    const Machine machine = this_machine();
    return {{"host", machine.host},     {"processor", machine.processor},
            {"cores", machine.cores},   {"memory_bytes", machine.memory_bytes},
            {"system", machine.system}, {"compiler", machine.compiler}};
}

Json inputs_json(const std::vector<std::filesystem::path>& files) {
    Json list = Json::array();
    for (const std::filesystem::path& file : files) {
        list.push_back({{"path", file.string()}, {"sha256", sha256_of_file(file)}});
    }
    return list;
}

Json backend_json(const BackendInfo& info) {
    return {{"name", info.name},
            {"summary", info.summary},
            {"device", info.device},
            {"threads", info.threads},
            {"instruction_set", info.instruction_set}};
}

Json passed_over_json(const std::vector<BackendStatus>& others) {
    Json list = Json::array();
    for (const BackendStatus& other : others) list.push_back({{"name", other.name}, {"reason", other.reason}});
    return list;
}

}  // namespace raylign::detail::apps
