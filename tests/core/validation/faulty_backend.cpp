#include "tests/core/validation/faulty_backend.h"

#include "raylign/backends.h"

namespace raylign::detail::test {
namespace {

/// The protected members of any Session, named through a class derived from it.
struct Opened : Session {
    using Session::accumulate;
    using Session::render_frame;
    using Sums = void (Session::*)(std::span<const RayFrame>, std::span<MomentSums>);
    using Derivatives = void (Session::*)(std::span<const RayFrame>, std::span<const RayFrameDerivatives>,
                                          std::span<JacobianSums>);
    static constexpr Sums kSums = &Opened::accumulate;
    static constexpr Derivatives kDerivatives = &Opened::accumulate;
    static constexpr Image (Session::*kRender)(const RayFrame&) = &Opened::render_frame;
    static constexpr DrrWithDerivatives (Session::*kRenderDerivatives)(const RayFrame&, const RayFrameDerivatives&) =
        &Opened::render_frame;
};

class FaultySession final : public Session {
public:
    FaultySession(const Scene& scene, std::unique_ptr<Session> inner, Fault fault)
        : Session(scene), inner_(std::move(inner)), fault_(std::move(fault)) {}

    FaultySession(const FaultySession& resident, std::span<const View> views, const Similarity& similarity)
        : Session(resident, views, similarity),
          inner_(resident.inner_->with_views(views, similarity)),
          fault_(resident.fault_) {}

    [[nodiscard]] std::size_t volume_bytes() const override { return inner_->volume_bytes(); }
    [[nodiscard]] std::unique_ptr<Session> with_views(std::span<const View> views,
                                                      const Similarity& similarity) override {
        return std::make_unique<FaultySession>(*this, views, similarity);
    }

protected:
    void accumulate(std::span<const RayFrame> frames, std::span<MomentSums> sums) override {
        (inner_.get()->*Opened::kSums)(bent(frames), sums);
        if (!fault_.in_sums) return;
        for (MomentSums& s : sums) fault_.in_sums(s);
    }
    void accumulate(std::span<const RayFrame> frames, std::span<const RayFrameDerivatives> derivatives,
                    std::span<JacobianSums> sums) override {
        (inner_.get()->*Opened::kDerivatives)(bent(frames), derivatives, sums);
        if (!fault_.in_derivatives) return;
        for (JacobianSums& s : sums) fault_.in_derivatives(s);
    }
    Image render_frame(const RayFrame& frame) override {
        Image image = (inner_.get()->*Opened::kRender)(bent({&frame, 1}).front());
        if (fault_.in_image) fault_.in_image(image);
        return image;
    }
    DrrWithDerivatives render_frame(const RayFrame& frame, const RayFrameDerivatives& derivatives) override {
        return (inner_.get()->*Opened::kRenderDerivatives)(bent({&frame, 1}).front(), derivatives);
    }
    void weights_changed() override {}

private:
    [[nodiscard]] std::vector<RayFrame> bent(std::span<const RayFrame> frames) const {
        std::vector<RayFrame> list(frames.begin(), frames.end());
        if (fault_.in_geometry) {
            for (RayFrame& frame : list) fault_.in_geometry(frame);
        }
        return list;
    }

    std::unique_ptr<Session> inner_;
    Fault fault_;
};

class FaultyBackend final : public Backend {
public:
    explicit FaultyBackend(Fault fault) : fault_(std::move(fault)) {}

    [[nodiscard]] BackendInfo info() const override {
        return {.name = "faulty", .summary = "with a planted fault", .device = "the tests"};
    }
    [[nodiscard]] std::unique_ptr<Session> prepare(const Scene& scene) override {
        Volume volume = scene.volume;
        if (fault_.in_volume) fault_.in_volume(volume);
        const Scene inner{volume, scene.views, scene.render, scene.similarity};
        return std::make_unique<FaultySession>(inner, inner_->prepare(inner), fault_);
    }

private:
    Fault fault_;
    std::unique_ptr<Backend> inner_ = create_backend("reference").backend;
};

}  // namespace

std::unique_ptr<Backend> make_faulty_backend(const Fault& fault) { return std::make_unique<FaultyBackend>(fault); }

}  // namespace raylign::detail::test
