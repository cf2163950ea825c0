#pragma once

#include <optional>
#include <span>
#include <vector>

#include "raylign/tracking.h"

namespace raylign::detail {

/// One frame's views: given at once, or made when they are first asked for. Borrows what it is made of.
class FrameViews {
public:
    explicit FrameViews(std::span<const View> given) : given_(given) {}
    explicit FrameViews(const ViewsFor& source) : source_(&source) {}

    [[nodiscard]] std::span<const View> in_full() { return get(full_, std::nullopt); }
    /// For the quick way; one `coarser_by` a frame.
    [[nodiscard]] std::span<const View> coarser(int coarser_by) { return get(coarse_, coarser_by); }

private:
    std::span<const View> get(std::optional<std::vector<View>>& made, std::optional<int> coarser_by) {
        if (source_ == nullptr) return given_;
        if (!made) made = (*source_)(coarser_by);
        return *made;
    }

    std::span<const View> given_;
    const ViewsFor* source_ = nullptr;
    std::optional<std::vector<View>> full_, coarse_;
};

}  // namespace raylign::detail
