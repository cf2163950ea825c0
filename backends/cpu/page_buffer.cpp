#include "backends/cpu/page_buffer.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <string>

#include "core/error.h"

namespace raylign::cpu {
namespace {

constexpr std::size_t kHugePage = std::size_t{2} << 20;

std::size_t physical_memory() {
    return static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

void ask_for_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_HUGEPAGE
    (void)madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: where it is refused, small pages do
#endif
}

}  // namespace

PageBuffer::PageBuffer(std::size_t bytes, const char* what) : bytes_(bytes) {
    const std::size_t padded = (bytes + kHugePage - 1) / kHugePage * kHugePage;
    // Linux hands out more than it has and kills later: refuse here what can never fit.
    if (padded <= physical_memory()) data_.reset(std::aligned_alloc(kHugePage, padded));
    if (!data_) {
        throw Error("memory: " + std::string(what) + " needs " + std::to_string((bytes >> 20) + 1) +
                    " MiB, which this machine does not have");
    }
    ask_for_huge_pages(data_.get(), padded);
    std::memset(data_.get(), 0, padded);
}

void PageBuffer::Free::operator()(void* memory) const { std::free(memory); }

}  // namespace raylign::cpu
