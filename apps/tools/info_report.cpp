#include "apps/tools/info_report.h"

#include "apps/shared/json_text.h"
#include "raylign/version.h"

namespace raylign::detail::apps {
namespace {

Json device_json(const DeviceStatus& device) {
    return {{"index", device.index},
            {"name", device.name},
            {"vendor", device.vendor},
            {"version", device.version},
            {"node", device.node},
            {"software", device.software},
            {"texture_3d_voxels", device.texture_3d_voxels},
            {"texture_layers", device.texture_layers},
            {"memory_bytes", device.memory_bytes},
            {"problem", device.problem}};
}

}  // namespace

std::string info_json(const std::vector<BackendStatus>& backends) {
    Json list = Json::array();
    for (const BackendStatus& status : backends) {
        Json entry = {{"name", status.name},
                      {"summary", status.summary},
                      {"available", status.available},
                      {"reason", status.reason}};
        if (status.available) {
            entry["device"] = status.info.device;
            entry["threads"] = status.info.threads;
            entry["instruction_set"] = status.info.instruction_set;
        }
        Json devices = Json::array();
        for (const DeviceStatus& device : status.devices) devices.push_back(device_json(device));
        entry["devices"] = devices;
        Json sets = Json::array();
        for (const InstructionSetStatus& set : status.instruction_sets) {
            sets.push_back({{"name", instruction_set_name(set.set)}, {"available", set.available}});
        }
        entry["instruction_sets"] = sets;
        list.push_back(entry);
    }
    return indented({{"raylign", RAYLIGN_VERSION}, {"backends", list}});
}

}  // namespace raylign::detail::apps
