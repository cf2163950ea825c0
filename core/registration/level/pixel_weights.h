#pragma once

#include <vector>

#include "core/backend.h"

namespace raylign::detail {

/// Weights 1 within `margin_px` (a square's half side) of the pixels that the volume's DRR reaches at the pose, per
/// view, and 0 beyond: what a small object is compared on, the same for all poses within the margin.
[[nodiscard]] std::vector<Image> neighbourhood(Session& session, const RigidTransform& world_from_ct, int margin_px);

/// Weights that even out the X-ray's gradients: per pixel mean(E) / (E_local + mean(E) / 20), where E is the sum of the
/// squared channels, E_local its Gaussian mean (sigma_px) and mean(E) its mean over pixels with weight. A rib's or a
/// heart's outline then counts no more than the fine edges of a bone elsewhere; no pose has a part in it.
[[nodiscard]] std::vector<Image> local_normalisation(const Session& session, double sigma_px);

/// True where these weights leave every view of the session as many usable pixels as set_weights asks for.
[[nodiscard]] bool leaves_enough(const Session& session, const std::vector<Image>& weights);

/// a *= b, image by image. Throws Error for sizes that disagree.
void multiply(std::vector<Image>& a, const std::vector<Image>& b);

/// Which pixels count at one level, and how much: base weights that stay, times robust weights that are renewed between
/// searches, never within one: poses are compared under the same weights.
class PixelWeights {
public:
    /// `base`: one image per view; none for what the views' masks say. Sets the session's weights.
    explicit PixelWeights(Session& session, const std::vector<Image>& base = {});

    /// Robust weights from the residuals at this pose.
    void reweight(const RigidTransform& world_from_ct);
    /// The last robust weights alone, one image per view; none before the first.
    [[nodiscard]] const std::vector<Image>& robust() const { return robust_; }

private:
    Session& session_;
    std::vector<FixedChannels> unweighted_;  ///< base and masks, before robust weights
    std::vector<Image> robust_;
};

}  // namespace raylign::detail
