#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>

#include "core/io/meshes/triangle_mesh.h"
#include "io_files.h"
#include "raylign/io/volume.h"
#include "tests/support/errors.h"
#include "tests/support/mesh_shapes.h"

namespace raylign::detail {
namespace {

using test::box_mesh;
using test::error_of;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

std::string binary_stl(const TriangleMesh& mesh) {
    std::string bytes(80, ' ');
    const auto put = [&bytes](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
    put(static_cast<std::uint32_t>(mesh.triangles.size()));
    for (const auto& triangle : mesh.triangles) {
        for (int i = 0; i < 3; ++i) put(0.0F);
        for (const std::int32_t corner : triangle) {
            for (const double x : mesh.vertices_mm[static_cast<std::size_t>(corner)]) put(static_cast<float>(x));
        }
        put(std::uint16_t{0});
    }
    return bytes;
}

std::string numbers(const Eigen::Vector3d& v) {
    return std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
}

std::string ascii_stl(const TriangleMesh& mesh) {
    std::string text = "solid part\n";
    for (const auto& triangle : mesh.triangles) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const std::int32_t corner : triangle) {
            text += "vertex " + numbers(mesh.vertices_mm[static_cast<std::size_t>(corner)]);
        }
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid part\n";
}

std::string obj(const TriangleMesh& mesh) {
    std::string text;
    for (const Eigen::Vector3d& v : mesh.vertices_mm) text += "v " + numbers(v);
    for (const auto& t : mesh.triangles) {
        text +=
            "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) + "\n";
    }
    return text;
}

std::string ply(const TriangleMesh& mesh) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(mesh.vertices_mm.size()) +
                       "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                       std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Eigen::Vector3d& v : mesh.vertices_mm) text += numbers(v);
    for (const auto& t : mesh.triangles) {
        text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
    }
    return text;
}

class MeshVolume : public test::IoTest {
protected:
    const TriangleMesh box_ = box_mesh<TriangleMesh>({1, 2, 3}, {13, 24, 35});
    const VolumeReadOptions options_{.material = "MU=0.5", .mesh_spacing_mm = 1};
};

double sum_of(const Volume& volume) {
    return std::accumulate(volume.attenuation_per_mm.begin(), volume.attenuation_per_mm.end(), 0.0);
}

TEST_F(MeshVolume, AllFormatsGiveTheSameVoxels) {
    const Volume binary = read_volume(write("b.stl", binary_stl(box_)), options_).volume;
    // 12 x 22 x 32 mm3 of 0.5 / mm.
    EXPECT_NEAR(sum_of(binary) * binary.grid.spacing_mm.prod(), 4224, 0.5);
    EXPECT_EQ(binary.grid.direction, Eigen::Matrix3d::Identity());
    for (const auto& [name, bytes] :
         {std::pair("a.STL", ascii_stl(box_)), {"o.obj", obj(box_)}, {"p.ply", ply(box_)}}) {
        const Volume other = read_volume(write(name, bytes), options_).volume;
        EXPECT_EQ(other.attenuation_per_mm, binary.attenuation_per_mm) << name;
        EXPECT_EQ(other.grid.origin_mm, binary.grid.origin_mm) << name;
    }
}

TEST_F(MeshVolume, TheMaterialMustBeSaidAndIsNoted) {
    const auto path = write("b.stl", binary_stl(box_));
    EXPECT_THAT(error_of([&] { (void)read_volume(path); }), AllOf(HasSubstr("b.stl"), HasSubstr("--material")));
    VolumeReadOptions options = options_;
    options.material = "titanium";
    EXPECT_THAT(read_volume(path, options).notes, Contains(HasSubstr("12 triangles around 8.45 cm3 of titanium")));
    options.hu_offset = -1024;
    EXPECT_THAT(error_of([&] { (void)read_volume(path, options); }), HasSubstr("--hu-offset"));
}

TEST_F(MeshVolume, WithoutASpacingItIsTheProposedOneOr256VoxelsAlong) {
    const auto path = write("b.stl", binary_stl(box_));
    VolumeReadOptions options = options_;
    options.mesh_spacing_mm.reset();
    EXPECT_EQ(read_volume(path, options).volume.grid.spacing_mm.x(), 0.125);  // 32 mm / 256
    options.proposed_mesh_spacing_mm = 0.4;
    EXPECT_EQ(read_volume(path, options).volume.grid.spacing_mm.x(), 0.4);
}

TEST_F(MeshVolume, AModelOfPartsHasEachOfItsMaterial) {
    write("cup.stl", binary_stl(box_mesh<TriangleMesh>({0, 0, 0}, {20, 20, 10})));
    write("liner.stl", binary_stl(box_mesh<TriangleMesh>({0, 0, 5}, {20, 20, 20})));
    const auto path = write("hip.json", R"({"raylign": 1, "parts": [
        {"mesh": "cup.stl", "material": "MU=0.5"}, {"mesh": "liner.stl", "material": "MU=0.1", "unit": "mm"}]})");
    const VolumeFile file = read_volume(path, {.mesh_spacing_mm = 1});
    EXPECT_EQ(file.files.size(), 3U);
    // Where both are, the first has the place.
    EXPECT_NEAR(sum_of(file.volume), 400 * (10 * 0.5 + 10 * 0.1), 1);
}

TEST_F(MeshVolume, UnlikelyUnitsAreNamedOrRefused) {
    TriangleMesh metres = box_, inches = box_;
    for (auto& v : metres.vertices_mm) v /= 1000;
    for (auto& v : inches.vertices_mm) v /= 25.4;
    const auto in_metres = write("m.stl", binary_stl(metres)), in_inches = write("in.stl", binary_stl(inches));
    EXPECT_THAT(error_of([&] { (void)read_volume(in_metres, options_); }),
                AllOf(HasSubstr("0.032 mm across"), HasSubstr("32 mm if it is in m"), HasSubstr("--mesh-unit")));
    VolumeReadOptions options = options_;
    options.mesh_spacing_mm = 0.1;
    EXPECT_THAT(read_volume(in_inches, options).notes, Contains(HasSubstr("32 mm if it is in in")));
    options.mesh_unit = "in";
    options.mesh_spacing_mm = 1;
    // Faces may err by a fiftieth of a voxel: 2176 mm2 of them, of 0.5 / mm.
    EXPECT_NEAR(sum_of(read_volume(in_inches, options).volume), 4224, 2176 * 0.02 * 0.5);
    options.mesh_unit = "m";
    EXPECT_THAT(error_of([&] { (void)read_volume(write("mm.stl", binary_stl(box_)), options); }),
                AllOf(HasSubstr("32000 mm across in m"), HasSubstr("32 mm if it is in mm"), HasSubstr("no size of")));
    options.mesh_unit = "furlong";
    EXPECT_THAT(error_of([&] { (void)read_volume(in_inches, options); }), HasSubstr("mm, cm, m or in"));
}

TEST_F(MeshVolume, DamagedFilesAreRefused) {
    const std::string bytes = binary_stl(box_);
    EXPECT_THAT(error_of([&] { (void)read_volume(write("cut.stl", bytes.substr(0, 300)), options_); }),
                HasSubstr("cut.stl"));
    EXPECT_THAT(error_of([&] { (void)read_volume(write("none.stl", binary_stl({})), options_); }),
                HasSubstr("none.stl"));
    EXPECT_THAT(error_of([&] { (void)read_volume(write("empty.stl", ""), options_); }), HasSubstr("empty"));
    std::string nan = bytes;
    const std::uint32_t quiet_nan = 0x7fc00000;
    std::memcpy(nan.data() + 84 + 50 * 3 + 12, &quiet_nan, 4);
    EXPECT_THAT(error_of([&] { (void)read_volume(write("nan.stl", nan), options_); }),
                AllOf(HasSubstr("triangle 4"), HasSubstr("NaN")));
}

TEST_F(MeshVolume, ItsSurfaceIsThatOfItsParts) {
    write("cup.stl", binary_stl(box_mesh<TriangleMesh>({0, 0, 0}, {20, 20, 10})));
    write("liner.stl", binary_stl(box_mesh<TriangleMesh>({0, 0, 12}, {20, 20, 20})));
    const auto path = write("hip.json", R"({"raylign": 1, "parts": [
        {"mesh": "cup.stl", "material": "MU=0.5"}, {"mesh": "liner.stl", "material": "MU=0.1"}]})");
    const std::shared_ptr<const Surface> surface = read_volume(path, {.mesh_spacing_mm = 1}).volume.surface;
    ASSERT_TRUE(surface);
    EXPECT_EQ(surface->triangles.size(), 24U);
    EXPECT_EQ(surface->attenuation_per_mm.front(), 0.5F);
    EXPECT_EQ(surface->attenuation_per_mm.back(), 0.1F);
    double low = 100, high = 0;  // of the second part
    for (const std::int32_t corner : surface->triangles.back()) {
        low = std::min(low, surface->vertices_mm[static_cast<std::size_t>(corner)].z());
        high = std::max(high, surface->vertices_mm[static_cast<std::size_t>(corner)].z());
    }
    EXPECT_GE(low, 12);
    EXPECT_LE(high, 20);
}

TEST_F(MeshVolume, WhereASurfaceIsNotTheWholeTruthThereIsNone) {
    const auto box = write("b.stl", binary_stl(box_));
    EXPECT_TRUE(read_volume(box, options_).volume.surface);
    VolumeReadOptions options = options_;
    options.keeps_surface = false;
    EXPECT_FALSE(read_volume(box, options).volume.surface) << "not asked for";
    options = options_;
    options.object.box_mm = CtBox{{0, 0, 0}, {13, 24, 20}};
    EXPECT_FALSE(read_volume(box, options).volume.surface) << "a part of the model";
    write("other.stl", binary_stl(box_mesh<TriangleMesh>({5, 5, 5}, {30, 24, 35})));
    const auto two = write("two.json", R"({"raylign": 1, "parts": [{"mesh": "b.stl"}, {"mesh": "other.stl"}]})");
    const VolumeFile shared = read_volume(two, options_);
    EXPECT_FALSE(shared.volume.surface) << "parts that lie in one another";
    EXPECT_THAT(shared.notes, Contains(AllOf(HasSubstr("other.stl"), HasSubstr("lie in parts before it"))));
    EXPECT_THAT(shared.notes, Contains(HasSubstr("DRRs are made from its voxels")));
}

}  // namespace
}  // namespace raylign::detail
