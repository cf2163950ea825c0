#include <gtest/gtest.h>

#include <cmath>

#include "backends/gl/volume_textures.h"
#include "core/base/error.h"
#include "gl_scenes.h"
#include "tests/support/image_compare.h"
#include "tests/support/tolerances.h"

namespace raylign::detail::gl {
namespace {

TEST(Int16Scale, KeepsZeroAndTheEndsOfTheRange) {
    for (const auto& [low, high] : {std::pair{0.0, 0.05}, {-0.01, 0.03}, {-0.02, -0.01}, {-1e-9, 1.0}, {0.3, 0.4}}) {
        const TexelScale scale = int16_scale(low, high);
        const auto texel = [&](double value) {
            return std::floor(65535 * (value / scale.scale_per_mm + scale.zero) + 0.5);
        };
        EXPECT_EQ(texel(0), 65535 * scale.zero) << low << " " << high << ": zero is a texel value";
        for (const double value : {low, 0.5 * low, high, 0.7 * high}) {
            EXPECT_GE(texel(value), 0);
            EXPECT_LE(texel(value), 65535);
            const double back = scale.scale_per_mm * (texel(value) / 65535 - scale.zero);
            EXPECT_NEAR(back, value, 0.5001 * scale.scale_per_mm / 65535);
        }
        EXPECT_LE(scale.scale_per_mm, 1.0001 * (std::max(high, 0.0) - std::min(low, 0.0)));
    }
    EXPECT_EQ(int16_scale(0, 0).zero, 0) << "an empty volume";
}

TEST(ObjectBox, HoldsAllThatIsNotZero) {
    Volume volume;
    volume.grid.size = {7, 6, 5};
    volume.attenuation_per_mm.assign(7 * 6 * 5, 0.F);
    EXPECT_EQ(object_box(volume).size, Eigen::Vector3i(1, 1, 1)) << "an empty volume";
    volume.attenuation_per_mm[volume.index(2, 3, 1)] = -1;
    volume.attenuation_per_mm[volume.index(5, 1, 4)] = 1;
    volume.attenuation_per_mm[volume.index(3, 2, 2)] = 1;
    EXPECT_EQ(object_box(volume).first, Eigen::Vector3i(2, 1, 1));
    EXPECT_EQ(object_box(volume).size, Eigen::Vector3i(4, 3, 4));
    volume.attenuation_per_mm.assign(7 * 6 * 5, 1.F);
    EXPECT_EQ(object_box(volume).size, Eigen::Vector3i(7, 6, 5));
}

/// The spine with wide margins of air on all sides but one.
Volume with_margins(const Volume& volume) {
    Volume padded;
    padded.grid = volume.grid;
    padded.grid.size += Eigen::Vector3i(9, 14, 11);
    padded.grid.origin_mm = volume.grid.ct_from_voxel({-4, -14, -5});
    padded.attenuation_per_mm.assign(padded.grid.voxel_count(), 0.F);
    for (int z = 0; z < volume.grid.size.z(); ++z) {
        for (int y = 0; y < volume.grid.size.y(); ++y) {
            for (int x = 0; x < volume.grid.size.x(); ++x) {
                padded.attenuation_per_mm[padded.index(x + 4, y + 14, z + 5)] = volume(x, y, z);
            }
        }
    }
    return padded;
}

TEST(GlCrop, ChangesNoImageAndNoDerivativeButTakesLessMemory) {
    RAYLIGN_NEED_GL(api);
    test::SpineScene spine;
    spine.volume = with_margins(spine.volume);
    const auto context = open_device(api, {});
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        GlSession whole(context, spine.scene(projector), {.exact = true});
        GlSession cropped(context, spine.scene(projector), {.exact = true, .crop = true});
        EXPECT_LT(cropped.volume_bytes(), whole.volume_bytes());
        const RigidTransform pose = spine.poses(2)[1];
        for (std::size_t view = 0; view < 2; ++view) {
            EXPECT_TRUE(test::images_near(cropped.render(pose, view), whole.render(pose, view), 2e-6));
        }
        Linearization a, b;
        whole.linearize({&pose, 1}, {1, 2, 3}, {&a, 1});
        cropped.linearize({&pose, 1}, {1, 2, 3}, {&b, 1});
        // Positions round differently, and slopes jump where a sample changes sides of a voxel.
        EXPECT_LT((a.gradient - b.gradient).norm(), 1e-3 * a.gradient.norm());
    }
}

TEST(GlVolume, LayoutsAreMadeWhenRaysAskForThem) {
    RAYLIGN_NEED_GL(api);
    const test::SpineScene spine;
    const auto context = open_device(api, {});
    GlSession session(context, spine.scene(), {});
    const std::size_t one = 24 * 24 * 24 * 2;
    (void)session.render(RigidTransform{}, 0);
    EXPECT_EQ(session.volume_layout(), "int16, layers across y");
    EXPECT_EQ(session.volume_bytes(), one);
    (void)session.render(RigidTransform{}, 1);
    EXPECT_EQ(session.volume_layout(), "int16, layers across x, y");
    EXPECT_EQ(session.volume_bytes(), 2 * one);
}

TEST(GlVolume, NegativeAttenuationIsKept) {
    RAYLIGN_NEED_GL(api);
    test::SpineScene spine;
    for (std::size_t i = 0; i < spine.volume.attenuation_per_mm.size(); i += 7) {
        spine.volume.attenuation_per_mm[i] -= 0.01F;
    }
    const auto reference = create_backend("reference").backend->prepare(spine.scene());
    for (const Storage storage : {Storage::int16, Storage::float32}) {
        const auto context = open_device(api, {});
        GlSession session(context, spine.scene(), {.storage = storage, .exact = true});
        const RigidTransform pose = spine.poses(2)[1];
        EXPECT_TRUE(test::images_near(session.render(pose, 1), reference->render(pose, 1), test::kInt16ImageShare));
    }
}

TEST(GlVolume, OneTooLargeForTheDeviceIsRefusedWithSizeAndLimitUnlessCropped) {
    RAYLIGN_NEED_GL(api);
    static decltype(api.gl.GetIntegerv) real = nullptr;
    real = api.gl.GetIntegerv;
    api.gl.GetIntegerv = [](GLenum name, GLint* value) {
        const bool size =
            name == GL_MAX_3D_TEXTURE_SIZE || name == GL_MAX_ARRAY_TEXTURE_LAYERS || name == GL_MAX_TEXTURE_SIZE;
        size ? void(*value = 30) : real(name, value);
    };
    test::SpineScene spine;
    spine.volume = with_margins(spine.volume);
    for (const Projector projector : {Projector::joseph, Projector::trilinear}) {
        const auto backend = make_gl_backend(api, {});
        try {
            (void)backend->prepare(spine.scene(projector));
            FAIL() << "must throw";
        } catch (const Error& error) {
            const std::string message = error.what();
            EXPECT_NE(message.find("33 x 38 x 35"), std::string::npos) << message;
            EXPECT_NE(message.find("at most 30"), std::string::npos) << message;
        }
        const auto cropping = make_gl_backend(api, {.crop = true});
        EXPECT_EQ(test::costs(*cropping->prepare(spine.scene(projector)), spine.poses(1)).size(), 1u);
    }
}

}  // namespace
}  // namespace raylign::detail::gl
