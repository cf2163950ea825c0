#include "apps/shared/manifest.h"

#include <nlohmann/json.hpp>

#include "apps/shared/machine.h"
#include "core/io/files/output.h"

namespace raylign::detail::apps {
namespace {

using Json = nlohmann::ordered_json;

std::string json_text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

std::string machine_json() {
    const Machine machine = this_machine();
    return json_text({{"host", machine.host},
                      {"processor", machine.processor},
                      {"cores", machine.cores},
                      {"memory_bytes", machine.memory_bytes},
                      {"system", machine.system},
                      {"compiler", machine.compiler}});
}

std::string inputs_json(const std::vector<std::filesystem::path>& files) {
    Json list = Json::array();
    for (const std::filesystem::path& file : files) {
        list.push_back({{"path", file.string()}, {"sha256", sha256_of_file(file)}});
    }
    return json_text(list);
}

std::string backend_json(const BackendInfo& info) {
    return json_text({{"name", info.name},
                      {"summary", info.summary},
                      {"device", info.device},
                      {"threads", info.threads},
                      {"instruction_set", info.instruction_set}});
}

}  // namespace raylign::detail::apps
