#include <array>
#include <bit>

#include "backends/gl/paper_pipeline.h"

namespace raylign::detail::gl {

PaperPipeline::Target PaperPipeline::make_target(std::string_view label, const Eigen::Vector2i& size_px,
                                                 const Formats& formats) {
    const Gl& gl = context_.gl();
    Target target;
    target.size_px = size_px;
    target.levels = formats.levels;
    target.framebuffer = make_framebuffer(gl, label);
    const auto attach = [&](GLenum format, GLenum point) {
        Texture texture = make_texture(gl, GL_TEXTURE_2D, label);
        gl.TextureStorage2D(texture.id(), formats.levels, format, size_px.x(), size_px.y());
        gl.TextureParameteri(texture.id(), GL_TEXTURE_MIN_FILTER, GL_NEAREST_MIPMAP_NEAREST);
        gl.TextureParameteri(texture.id(), GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        gl.NamedFramebufferTexture(target.framebuffer.id(), point, texture.id(), 0);
        return texture;
    };
    target.texture = attach(formats.first, GL_COLOR_ATTACHMENT0);
    if (formats.second != GL_NONE) target.second = attach(formats.second, GL_COLOR_ATTACHMENT1);
    constexpr std::array<GLenum, 2> kPoints = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    gl.NamedFramebufferDrawBuffers(target.framebuffer.id(), formats.second == GL_NONE ? 1 : 2, kPoints.data());
    context_.check("making a target of " + std::to_string(size_px.x()) + " x " + std::to_string(size_px.y()) +
                   " pixels");
    return target;
}

/// All products, at the lower left of a target whose sides are powers of two: the mean of its mipmap counts each once.
PaperPipeline::Target PaperPipeline::make_mipmap(const Eigen::Vector2i& size_px) {
    const auto up = [](int size) { return static_cast<int>(std::bit_ceil(static_cast<unsigned>(size))); };
    const Eigen::Vector2i whole(up(size_px.x()), up(size_px.y()));
    const int levels = std::bit_width(static_cast<unsigned>(whole.maxCoeff()));
    if (options_.reduction == Reduction::mipmap_half) {
        return make_target("products", whole, {GL_RGBA16F, GL_R16F, levels});
    }
    return make_target("products", whole, {GL_RGBA32F, GL_R32F, levels});
}

void PaperPipeline::make_view(const Eigen::Vector2i& size_px) {
    ViewTargets made;
    made.drr = make_target("DRR", size_px, {GL_R32F});
    if (!fixed_.empty()) {
        made.fixed = make_texture(context_.gl(), GL_TEXTURE_2D, "fixed image");
        context_.gl().TextureStorage2D(made.fixed.id(), 1, GL_RGBA32F, size_px.x(), size_px.y());
        if (channels_ == 2) {
            made.rows = make_target("image filtered along x", size_px, {GL_RG32F});
            made.gradients = make_target("gradient images", size_px, {GL_RG32F});
        }
        if (options_.reduction == Reduction::passes) {
            const Eigen::Vector2i once = reduced(size_px), twice = reduced(once);
            made.products = make_target("sums of 3 x 3", once, {GL_RGBA32F, GL_R32F});
            made.steps[0] = make_target("reduction", twice, {GL_RGBA32F, GL_R32F});
            made.steps[1] = make_target("reduction", reduced(twice), {GL_RGBA32F, GL_R32F});
        } else {
            made.products = make_mipmap(size_px);
        }
    }
    views_.push_back(std::move(made));
}

}  // namespace raylign::detail::gl
