#pragma once

#include <span>
#include <vector>

#include "raylign/tracking.h"

namespace raylign::detail {

/// Whether frames may be found on one level alone (follow_resident), and what is usual there. Frames that are
/// registered in full say so: where both ways were gone and agree twice, the quick one is gone alone; where they
/// disagree, a finer level is tried, and then none. A function of the frames remembered, so that a track that goes on
/// ends alike.
class QuickWay {
public:
    [[nodiscard]] bool is_open() const { return coarser_by_ >= 0; }
    /// The quick way has been compared with the full one often enough to be gone alone.
    [[nodiscard]] bool is_confirmed() const;
    /// Levels above the finest.
    [[nodiscard]] int coarser_by() const { return coarser_by_; }
    /// No view costs more than it did where both ways agreed and lately, as the verdict's bounds are for the full way's
    /// costs: on a coarser level noise is averaged away and wrong poses cost less, too.
    [[nodiscard]] bool is_usual(std::span<const double> view_costs) const;
    /// How much higher costs are lately than where both ways agreed; at least 1.
    [[nodiscard]] double drift() const;

    /// What errors expected on the one level are to be multiplied by: the full way, with its finer levels and rounds,
    /// may have expected more where both agreed. At least 1.
    [[nodiscard]] double error_ratio() const;

    void remember(const TrackFrame& found);

private:
    int coarser_by_ = 1, agreed_ = 0;
    std::vector<std::vector<double>> compared_, lately_;  ///< [frame][view]: costs of the quick way
    std::vector<double> error_ratios_;                    ///< of the frames that were compared
};

}  // namespace raylign::detail
