#include "core/io/volumes/square_grid.h"

#include <gmock/gmock.h>

#include <cmath>

#include "core/base/linear_algebra.h"
#include "core/io/volumes/volume_grid.h"
#include "io_files.h"
#include "raylign/io/volume.h"
#include "tests/support/test_data.h"

namespace raylign::detail {
namespace {

using test::error_of;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

/// A CT whose gantry was tilted by `angle_rad` about x: slices lie askew on the way of the table, z.
VoxelGrid tilted_grid(double angle_rad) {
    VoxelGrid grid;
    grid.size = {12, 20, 9};
    grid.spacing_mm = {0.5, 0.75, 2.5};
    grid.origin_mm = {-3, 40, 500};
    grid.direction << 1, 0, 0, 0, std::cos(angle_rad), 0, 0, std::sin(angle_rad), 1;
    return grid;
}

double linear(const Eigen::Vector3d& x) { return 10 + 0.02 * x.x() - 0.03 * x.y() + 0.011 * x.z(); }

Volume sampled(const VoxelGrid& grid) {
    Volume volume{grid, {}};
    for (int z = 0; z < grid.size.z(); ++z) {
        for (int y = 0; y < grid.size.y(); ++y) {
            for (int x = 0; x < grid.size.x(); ++x) {
                volume.attenuation_per_mm.push_back(static_cast<float>(
                    linear(grid.origin_mm + grid.direction * grid.spacing_mm.cwiseProduct(Eigen::Vector3d(x, y, z)))));
            }
        }
    }
    return volume;
}

/// The lattice coordinates of a point, of axes at any angles.
Eigen::Vector3d lattice_of(const VoxelGrid& grid, const Eigen::Vector3d& x_ct) {
    const Eigen::Matrix3d lattice = grid.direction * grid.spacing_mm.asDiagonal();
    return inverse_of(lattice) * (x_ct - grid.origin_mm);
}

/// Every voxel inside the sheared lattice has the function's value, those outside are 0; some of both there are.
void expect_linear(const VoxelGrid& sheared) {
    Volume volume = sampled(sheared);
    std::vector<std::string> notes;
    on_square_grid(volume, notes);
    const VoxelGrid& grid = volume.grid;
    EXPECT_LT((grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    int inside = 0, outside = 0;
    for (int z = 0; z < grid.size.z(); ++z) {
        for (int y = 0; y < grid.size.y(); ++y) {
            for (int x = 0; x < grid.size.x(); ++x) {
                const Eigen::Vector3d at = grid.ct_from_voxel(Eigen::Vector3d(x, y, z));
                const Eigen::Array3d voxel = lattice_of(sheared, at), last = sheared.size.cast<double>().array() - 1;
                if ((voxel > -1e-9).all() && (voxel < last + 1e-9).all()) {
                    ASSERT_NEAR(volume(x, y, z), linear(at), 2e-6);
                    ++inside;
                } else if (!((voxel > -1).all() && (voxel < last + 1).all())) {
                    ASSERT_EQ(volume(x, y, z), 0);
                    ++outside;
                }
            }
        }
    }
    EXPECT_GT(inside, sheared.voxel_count() * 3 / 4);
    EXPECT_GT(outside, 0);
    EXPECT_THAT(notes, Contains(HasSubstr("resampled to a square grid")));
}

TEST(SquareGrid, TiltedGantryLeavesALinearFieldAsItWas) { expect_linear(tilted_grid(0.3)); }

TEST(SquareGrid, AnyAxesMayBeSheared) {
    VoxelGrid grid = tilted_grid(-0.2);
    grid.direction.col(1) = Eigen::Vector3d(0.2, 0.9, -0.1).normalized();
    grid.direction.col(0) = Eigen::Vector3d(-1, 0.1, 0.05).normalized();  // left-handed, too
    expect_linear(grid);
    VoxelGrid sagittal = tilted_grid(0);  // slices are counted by x
    sagittal.spacing_mm = {3, 0.75, 0.5};
    sagittal.direction.col(0) = Eigen::Vector3d(std::cos(0.25), 0, std::sin(0.25));
    expect_linear(sagittal);
}

TEST(SquareGrid, SlicesOfATiltedGantryStayAndMoveWithinThemselves) {
    const VoxelGrid sheared = tilted_grid(0.3);
    Volume volume = sampled(sheared);
    std::vector<std::string> notes;
    on_square_grid(volume, notes);
    EXPECT_EQ(volume.grid.size.x(), sheared.size.x());
    EXPECT_EQ(volume.grid.size.z(), sheared.size.z());
    EXPECT_GT(volume.grid.size.y(), sheared.size.y());
    EXPECT_NEAR(volume.grid.spacing_mm.z(), 2.5 * std::cos(0.3), 1e-12);
    EXPECT_THAT(notes.front(), testing::AllOf(HasSubstr("17.189 degrees"), HasSubstr("0.5 x 0.75 x 2.388 mm")));
}

TEST(SquareGrid, MassIsKept) {
    Volume volume = sampled(tilted_grid(0.3));
    const auto mass = [](const Volume& v) {
        double sum = 0;
        for (const float value : v.attenuation_per_mm) sum += value;
        return sum * std::abs(determinant_of(v.grid.direction * v.grid.spacing_mm.asDiagonal()));
    };
    const double before = mass(volume);
    std::vector<std::string> notes;
    on_square_grid(volume, notes);
    EXPECT_NEAR(mass(volume) / before, 1, 1e-3);
}

TEST(SquareGrid, LabelsAreThoseOfTheNearestVoxel) {
    LabelMap map{tilted_grid(0.3), {}};
    for (int i = 0; i < map.grid.voxel_count(); ++i) map.labels.push_back(i + 1);
    const LabelMap before = map;
    std::vector<std::string> notes;
    on_square_grid(map, notes);
    std::size_t index = 0;
    for (int z = 0; z < map.grid.size.z(); ++z) {
        for (int y = 0; y < map.grid.size.y(); ++y) {
            for (int x = 0; x < map.grid.size.x(); ++x) {
                const Eigen::Vector3d at = lattice_of(before.grid, map.grid.ct_from_voxel(Eigen::Vector3d(x, y, z)));
                const Eigen::Array3i voxel = at.array().round().cast<int>();
                const bool is_inside = (voxel >= 0).all() && (voxel < before.grid.size.array()).all();
                const int label = is_inside ? (voxel[2] * 20 + voxel[1]) * 12 + voxel[0] + 1 : 0;
                ASSERT_EQ(map.labels[index++], label);
            }
        }
    }
    EXPECT_THAT(notes, Contains(HasSubstr("by the nearest label")));
}

TEST(SquareGrid, SquareGridsStayAsTheyAre) {
    Volume volume = sampled(tilted_grid(0));
    const Volume before = volume;
    std::vector<std::string> notes;
    check_and_square(volume.grid, "here", notes);
    on_square_grid(volume, notes);
    EXPECT_EQ(volume.attenuation_per_mm, before.attenuation_per_mm);
    EXPECT_EQ(volume.grid.direction, before.grid.direction);
    EXPECT_THAT(notes, IsEmpty());
}

TEST(SquareGrid, SlightShearIsSquaredWithANote) {
    VoxelGrid grid = tilted_grid(5e-4);
    std::vector<std::string> notes;
    check_and_square(grid, "here", notes);
    EXPECT_LT((grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_THAT(notes, Contains(HasSubstr("not quite at right angles")));
}

TEST(SquareGrid, AxesInAPlaneAreRefused) {
    VoxelGrid grid = tilted_grid(0);
    grid.direction.col(2) = Eigen::Vector3d(1, 1, 0).normalized();  // at 45 degrees to both others
    std::vector<std::string> notes;
    EXPECT_THAT(error_of([&] { check_and_square(grid, "here", notes); }),
                HasSubstr("here: its voxel axes lie in a plane"));
}

class SquareGridFile : public test::IoTest {};

TEST_F(SquareGridFile, TiltedCtIsReadWithANote) {
    test::NiftiBytes nifti;
    nifti.sform[9] = 0.15F;
    const auto path = write("ct.nii", nifti.with(test::bytes_of(test::small_hu())));
    const VolumeFile file = read_volume(path);
    EXPECT_THAT(file.notes, Contains(HasSubstr("11.31 degrees off a right angle")));
    EXPECT_GT(file.volume.grid.size.y(), 2);
    EXPECT_EQ(file.file_grid.size, file.volume.grid.size);
    EXPECT_EQ(read_volume_grid(path).size, file.volume.grid.size);
    EXPECT_EQ(read_volume_grid(path).origin_mm, file.volume.grid.origin_mm);
    EXPECT_GT(read_label_map(path, file.volume.grid).grid.size.y(), 2);
}

TEST_F(SquareGridFile, RealTiltedCtIsResampled) {
    const auto path = test::test_data() / "oblique" / "shear.nii.gz";
    RAYLIGN_NEED_DATA(path);
    const VolumeFile file = read_volume(path);
    EXPECT_THAT(file.notes, Contains(testing::AllOf(HasSubstr("18.5 degrees"), HasSubstr("306 x 505 x 54"))));
    // The voxels' volume stays: rows and slices of the sform's columns, the slices' part across the rows.
    EXPECT_NEAR(file.volume.grid.spacing_mm.prod(), 0.482421875 * 0.45749205 * 2.3708093, 1e-6);
}

}  // namespace
}  // namespace raylign::detail
