#include "backends/cpu/page_buffer.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <string>

#include "core/base/error.h"

namespace raylign::detail::cpu {
namespace {

constexpr std::size_t kHugePage = PageBuffer::kPageBytes;

void ask_for_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_HUGEPAGE
    (void)madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: where it is refused, small pages do
#endif
}

/// `bytes`, a multiple of kHugePage, at a multiple of kHugePage; null where the system has none.
void* map_pages(std::size_t bytes) {
    void* const mapped = mmap(nullptr, bytes + kHugePage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapped == MAP_FAILED) return nullptr;
    char* const begin = static_cast<char*>(mapped);
    const std::size_t before = (kHugePage - reinterpret_cast<std::uintptr_t>(begin) % kHugePage) % kHugePage;
    if (before > 0) munmap(begin, before);
    munmap(begin + before + bytes, kHugePage - before);
    ask_for_huge_pages(begin + before, bytes);
    return begin + before;
}

/// What a container's limit leaves: the limit less what is used, but for files that can be read again.
std::size_t free_in_container() {
    std::size_t limit = 0, used = 0, files = 0;
    if (!(std::ifstream("/sys/fs/cgroup/memory.max") >> limit)) return SIZE_MAX;  // no limit, or the word "max"
    std::ifstream("/sys/fs/cgroup/memory.current") >> used;
    std::ifstream stat("/sys/fs/cgroup/memory.stat");
    for (std::string key; stat >> key;) {
        std::size_t bytes = 0;
        stat >> bytes;
        if (key == "inactive_file") files = bytes;
    }
    used -= std::min(files, used);
    return limit - std::min(used, limit);
}

}  // namespace

PageBuffer::PageBuffer(std::size_t bytes, const char* what) : bytes_(bytes) {
    // Linux hands out more than it has and kills later: refuse here what cannot fit.
    if (bytes <= free_memory()) {
        const std::size_t padded = (bytes + kHugePage - 1) / kHugePage * kHugePage;
        data_ = {map_pages(padded), Unmap{padded}};
    }
    if (!data_) {
        throw Error("memory: " + std::string(what) + " needs " + std::to_string((bytes >> 20) + 1) + " MiB, and only " +
                    std::to_string(free_memory() >> 20) + " MiB are free");
    }
}

void PageBuffer::Unmap::operator()(void* memory) const { munmap(memory, bytes); }

std::size_t free_memory() {
    auto bytes = static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    std::ifstream machine("/proc/meminfo");
    for (std::string key, rest; machine >> key; std::getline(machine, rest)) {
        std::size_t kib = 0;
        if (key == "MemAvailable:" && machine >> kib) bytes = std::min(bytes, kib << 10);
    }
    return std::min(bytes, free_in_container());
}

}  // namespace raylign::detail::cpu
