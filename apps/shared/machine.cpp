#include "apps/shared/machine.h"

#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <fstream>

#include "core/base/usable_cores.h"

namespace raylign::detail::apps {
namespace {

/// The value of the first line "name : value" whose name begins so.
std::string value_of_line(const char* file, const std::string& name) {
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
        if (line.rfind(name, 0) != 0) continue;
        const std::size_t value = line.find_first_not_of(" \t", line.find_first_of(":=") + 1);
        if (value == std::string::npos) continue;
        std::string text = line.substr(value);
        if (text.size() > 1 && text.front() == '"' && text.back() == '"') text = text.substr(1, text.size() - 2);
        return text;
    }
    return {};
}

}  // namespace

Machine this_machine() {
    Machine machine;
    utsname names{};
    if (uname(&names) == 0) {
        machine.host = names.nodename;
        machine.system = std::string(names.sysname) + " " + names.release + " " + names.machine;
    }
    const std::string distribution = value_of_line("/etc/os-release", "PRETTY_NAME");
    if (!distribution.empty()) machine.system = distribution + ", " + machine.system;
    machine.processor = value_of_line("/proc/cpuinfo", "model name");
    machine.cores = usable_cores();
    const long pages = sysconf(_SC_PHYS_PAGES), page_bytes = sysconf(_SC_PAGE_SIZE);
    if (pages > 0 && page_bytes > 0) machine.memory_bytes = static_cast<std::size_t>(pages) * page_bytes;
#if defined(__clang__)
    machine.compiler = "clang " __clang_version__;
#elif defined(__GNUC__)
    machine.compiler = "g++ " __VERSION__;
#endif
    return machine;
}

std::size_t peak_memory_bytes() {
    rusage usage{};
    return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<std::size_t>(usage.ru_maxrss) * 1024 : 0;
}

}  // namespace raylign::detail::apps
