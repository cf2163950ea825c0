#pragma once

#include <cstddef>
#include <memory>

namespace raylign::cpu {

/// Zeroed memory for voxels, on pages of 2 MiB where the system has them: a slab touches thousands of rows, each on a
/// 4-KiB page of its own otherwise.
class PageBuffer {
public:
    PageBuffer() = default;
    /// Throws Error, before anything is allocated, where the machine's memory cannot hold it. `what` names it.
    PageBuffer(std::size_t bytes, const char* what);

    [[nodiscard]] void* data() const { return data_.get(); }
    [[nodiscard]] std::size_t bytes() const { return bytes_; }

private:
    struct Free {
        void operator()(void* memory) const;
    };
    std::unique_ptr<void, Free> data_;
    std::size_t bytes_ = 0;
};

}  // namespace raylign::cpu
