#pragma once

#include <cstddef>
#include <memory>

namespace raylign::detail::cpu {

/// Zeroed memory for voxels, on pages of 2 MiB where the system has them: a slab touches thousands of rows, each on a
/// 4-KiB page of its own otherwise. The system clears a page when it is first touched, by the thread that touches it.
class PageBuffer {
public:
    static constexpr std::size_t kPageBytes = std::size_t{2} << 20;

    PageBuffer() = default;
    /// Throws Error, before anything is allocated, where the memory that is free now cannot hold it. `what` names it.
    PageBuffer(std::size_t bytes, const char* what);

    [[nodiscard]] void* data() const { return data_.get(); }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

private:
    struct Unmap {
        std::size_t bytes;
        void operator()(void* memory) const;
    };
    std::unique_ptr<void, Unmap> data_;
    std::size_t bytes_ = 0;
};

/// Memory that this process can still get [bytes]: what is free or can be freed, and no more than a container's limit.
[[nodiscard]] std::size_t free_memory();

}  // namespace raylign::detail::cpu
