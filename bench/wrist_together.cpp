#include "bench/wrist_together.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>
#include <vector>

#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/random.h"
#include "core/registration/scene/scene.h"
#include "raylign/registration.h"
#include "raylign/start.h"
#include "raylign/targets.h"
#include "tests/support/wrist.h"

namespace raylign::detail::bench {
namespace {

// The file of the second and third metacarpal begins 53 rows before that of the third; all voxels of the third agree.
constexpr int kRowsBefore = 53;

struct Apart {
    double centre_mm = 0, rotation_deg = 0;
    [[nodiscard]] bool is_small() const { return centre_mm < kCentreBound_mm && rotation_deg < kRotationBound_deg; }
};

Apart apart(const Volume& bone, const RigidTransform& a, const RigidTransform& b) {
    const Eigen::Vector3d centre_ct = bone.grid.centre_ct_mm();
    return {(a * centre_ct - b * centre_ct).norm(), rotation_angle_rad(a * inverse(b)) * 180 / std::numbers::pi};
}

double processor_s() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

Volume read_bone(const std::filesystem::path& file) {
    VolumeReadOptions options;
    options.spacing_mm = Eigen::Vector3d(0.39625, 0.39625, 0.625);
    options.hu_offset = -1024;
    return read_volume(file, options).volume;
}

struct Metacarpal {
    std::string name;
    Volume volume;
    RigidTransform about_world_from_ct;  ///< what starts are off from
};

/// Found from the radius' orientation, without a place.
RigidTransform third_metacarpal(const test::Wrist& wrist, const Volume& bone, Backend& backend) {
    const RigidTransform turned{wrist.reference_world_from_ct.rotation, Eigen::Vector3d::Zero()};
    const Eigen::Vector3d centre_ct = bone.grid.centre_ct_mm();
    const Eigen::Vector3d middle_world = default_start(bone.grid, wrist.views) * centre_ct;
    RegistrationOptions options;
    options.search.mode = Search::global;
    options.content = Content::part;
    const RegistrationResult found = register_volume(
        bone, wrist.views, RigidTransform::translate(middle_world - turned * centre_ct) * turned, options, backend);
    std::printf("third metacarpal by a global search: cost %.4f, expected error %.3f mm, %s\n", found.cost_final,
                found.confidence.rim_mm, found.ok ? "ok" : found.reasons.front().c_str());
    return found.world_from_ct;
}

/// What one way of registering found, start by start.
struct Way {
    const char* name;
    std::array<std::vector<RigidTransform>, 2> poses{};  ///< radius, metacarpal
    std::array<int, 2> ok{};
    std::vector<double> expected_mm{}, seconds{};

    void take(std::size_t bone, const RegistrationResult& found) {
        poses[bone].push_back(found.world_from_ct);
        ok[bone] += found.ok ? 1 : 0;
        if (bone == 1) expected_mm.push_back(found.confidence.rim_mm);
    }
};

void run_start(const test::Wrist& wrist, const Metacarpal& other, std::uint64_t seed, double most_mm, Backend& backend,
               Way& together, Way& alone) {
    Random random(seed);
    const RigidTransform radius = perturbed_start(wrist.reference_world_from_ct, default_targets_ct_mm(wrist.radius),
                                                  random.uniform(0, most_mm), seed);
    const RigidTransform metacarpal = perturbed_start(other.about_world_from_ct, default_targets_ct_mm(other.volume),
                                                      random.uniform(0, most_mm), seed + 1000);
    const std::array<SceneObject, 2> objects{SceneObject{"radius", wrist.radius, radius},
                                             SceneObject{other.name, other.volume, metacarpal}};
    double begin_s = processor_s();
    const SceneResult scene = register_scene(objects, wrist.views, {}, backend);
    together.seconds.push_back(processor_s() - begin_s);
    begin_s = processor_s();
    for (std::size_t k = 0; k < objects.size(); ++k) {
        together.take(k, scene.objects[k]);
        alone.take(k, register_volume(objects[k].volume, wrist.views, objects[k].start_world_from_ct,
                                      {.content = Content::part}, backend));
    }
    alone.seconds.push_back(processor_s() - begin_s);
}

/// The pose that the others are nearest to.
RigidTransform middle_of(const Volume& bone, const std::vector<RigidTransform>& poses) {
    return *std::ranges::min_element(poses, {}, [&](const RigidTransform& pose) {
        std::vector<double> centres_mm;
        for (const RigidTransform& other : poses) centres_mm.push_back(apart(bone, pose, other).centre_mm);
        return median(centres_mm);
    });
}

struct Spread {
    int within = 0;
    std::vector<double> centre_mm, rotation_deg;
};

Spread spread(const Volume& bone, const std::vector<RigidTransform>& poses, const RigidTransform& about) {
    Spread spread;
    for (const RigidTransform& pose : poses) {
        const Apart off = apart(bone, pose, about);
        spread.within += off.is_small();
        spread.centre_mm.push_back(off.centre_mm);
        spread.rotation_deg.push_back(off.rotation_deg);
    }
    return spread;
}

void tell(const test::Wrist& wrist, const Metacarpal& other, int instant, const Way& way, Record& record) {
    const Spread radius = spread(wrist.radius, way.poses[0], wrist.reference_world_from_ct);
    const Spread own = spread(other.volume, way.poses[1], middle_of(other.volume, way.poses[1]));
    const auto starts = static_cast<int>(way.seconds.size());
    std::printf(
        "instant %2d %s: radius %d of %d, median %.3f mm %.2f deg, ok %d; %s %d of %d about their middle, median %.3f "
        "mm "
        "%.2f deg, max %.3f mm %.2f deg, expected %.3f mm, ok %d; processor %.2f s\n",
        instant, way.name, radius.within, starts, median(radius.centre_mm), median(radius.rotation_deg), way.ok[0],
        other.name.c_str(), own.within, starts, median(own.centre_mm), median(own.rotation_deg),
        std::ranges::max(own.centre_mm), std::ranges::max(own.rotation_deg), median(way.expected_mm), way.ok[1],
        median(way.seconds));
    std::fflush(stdout);
    record.add({way.name, instant, other.name, radius.within, starts, median(radius.centre_mm),
                median(radius.rotation_deg), way.ok[0], own.within, median(own.centre_mm), median(own.rotation_deg),
                std::ranges::max(own.centre_mm), way.ok[1], median(way.seconds)});
}

}  // namespace

void run_together(const std::filesystem::path& folder, int instant, int starts, double most_mm, Backend& backend,
                  Record& record) {
    const test::Wrist wrist = test::read_wrist(folder, instant);
    std::array<Metacarpal, 2> bones{Metacarpal{"mc3", read_bone(folder / "mc3_dcm_cropped.tif"), {}},
                                    Metacarpal{"mc2_mc3", read_bone(folder / "mc2_mc3_dcm_cropped.tif"), {}}};
    const double rows_mm = kRowsBefore * bones[0].volume.grid.spacing_mm.y();
    const RigidTransform third_from_both = RigidTransform::translate({0, -rows_mm, 0});
    bones[0].about_world_from_ct = third_metacarpal(wrist, bones[0].volume, backend);
    bones[1].about_world_from_ct = bones[0].about_world_from_ct * third_from_both;
    std::vector<RigidTransform> third;  // where each of the two has it
    for (const Metacarpal& bone : bones) {
        Way together{"together"}, alone{"alone"};
        for (int seed = 0; seed < starts; ++seed) {
            run_start(wrist, bone, static_cast<std::uint64_t>(seed), most_mm, backend, together, alone);
        }
        tell(wrist, bone, instant, together, record);
        tell(wrist, bone, instant, alone, record);
        third.push_back(middle_of(bone.volume, together.poses[1]));
    }
    const Apart off = apart(bones[0].volume, third[0], third[1] * inverse(third_from_both));
    std::printf("instant %2d: the third metacarpal by both files is %.3f mm and %.2f deg apart\n", instant,
                off.centre_mm, off.rotation_deg);
}

}  // namespace raylign::detail::bench
