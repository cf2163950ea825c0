// How much faster is the cpu backend than other DRR programs? Same volume, same rays, same number of threads, random
// poses, all programs in turn on each pose, images compared on each pose.
//
// Usage: raylign_peers [volume=256] [pixels=256] [threads=2] [poses=21] [spread_deg=180] [rounds=3] [--json FILE]
//
// volume: 256 (spine phantom, 256^3), 512 (512 x 512 x 256) or a CT file.
//
// spread_deg: 180 = all orientations alike; less = turned by up to that from the frontal view.

#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "bench/peers.h"
#include "bench/program.h"
#include "bench/record.h"
#include "core/base/error.h"
#include "core/base/median.h"
#include "core/base/random.h"
#include "raylign/backends.h"
#include "raylign/io/volume.h"
#include "tests/support/scenes.h"

namespace raylign::detail::bench {
namespace {

constexpr int kOwnRepeats = 3;  // per pose and round; the first follows another program and finds cold caches
// Limits for "the same image": the volume models differ (trilinear field, constant voxels, bilinear planes), and with
// them every silhouette by up to a pixel or two, but no image as a whole.
constexpr double kLeastCorrelation = 0.999;
constexpr double kLargestMeanDifference = 5e-3;  // of the maximum

/// Per pose. Seconds: the least over the rounds, as another process can only add to it.
struct Timing {
    std::string name;
    std::vector<double> seconds, cold_s, correlation, mean_difference, max_difference;
};

Timing make_timing(const std::string& name, std::size_t poses) {
    const std::vector<double> never(poses, std::numeric_limits<double>::infinity());
    return {.name = name, .seconds = never, .cold_s = never};
}

/// A folder that is gone with this object.
struct TemporaryFolder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("raylign_peers_" + std::to_string(::getpid()));
    TemporaryFolder() { std::filesystem::create_directories(path); }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

/// The volume is centred on the ct origin, its axes run along ct: the peers know no other directions.
Volume make_volume(const std::string& name) {
    const auto phantom = [](const Eigen::Vector3i& size) {
        const Eigen::Vector3d spacing_mm = Eigen::Vector3d::Constant(160.0 / 256);
        return voxelise(spine_phantom(size.cast<double>().cwiseProduct(spacing_mm)), centred_grid(size, spacing_mm), 2);
    };
    if (name == "256") return phantom({256, 256, 256});
    if (name == "512") return phantom({512, 512, 256});
    Volume volume = read_volume(name, {.hu_preset = "plastimatch"}).volume;
    volume.grid = centred_grid(volume.grid.size, volume.grid.spacing_mm);
    return volume;
}

RigidTransform random_pose(Random& random, double spread_deg) {
    Eigen::Vector4d q(random.normal(), random.normal(), random.normal(), random.normal());
    q.normalize();
    RigidTransform pose;
    pose.rotation = Eigen::Quaterniond(q).toRotationMatrix();
    if (spread_deg < 180) {
        Twist turn = Twist::Zero();
        turn.head<3>() = random.direction() * random.uniform(0, spread_deg) * std::numbers::pi / 180;
        pose = exp(turn);
    }
    for (int i = 0; i < 3; ++i) pose.translation_mm[i] = random.uniform(-10, 10);
    return pose;
}

std::vector<RigidTransform> random_poses(int count, double spread_deg) {
    Random random(7);
    std::vector<RigidTransform> poses;
    for (int i = 0; i < count; ++i) poses.push_back(random_pose(random, spread_deg));
    return poses;
}

void compare(const Image& image, const Image& own, Timing& timing) {
    if (image.width != own.width || image.height != own.height) throw Error(timing.name + ": image of another size");
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0, sum = 0, largest = 0, maximum = 0;
    const auto n = static_cast<double>(own.pixels.size());
    for (std::size_t i = 0; i < own.pixels.size(); ++i) {
        const double x = image.pixels[i], y = own.pixels[i];
        a += x;
        b += y;
        aa += x * x;
        bb += y * y;
        ab += x * y;
        sum += std::abs(x - y);
        largest = std::max(largest, std::abs(x - y));
        maximum = std::max(maximum, y);
    }
    timing.correlation.push_back((ab - a * b / n) / std::sqrt((aa - a * a / n) * (bb - b * b / n)));
    timing.mean_difference.push_back(sum / n / maximum);
    timing.max_difference.push_back(largest / maximum);
}

Image render_own(Session& session, const RigidTransform& pose, std::size_t index, Timing& timing) {
    Image image;
    std::vector<double> seconds;
    for (int i = 0; i < kOwnRepeats; ++i) {
        const auto start = std::chrono::steady_clock::now();
        image = session.render(pose, 0);
        seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
    timing.cold_s[index] = std::min(timing.cold_s[index], seconds.front());
    timing.seconds[index] = std::min(timing.seconds[index], median(seconds));
    return image;
}

/// raylign once more, with voxels of half the size.
Peer int16_peer(const Volume& volume, const std::vector<View>& views, int threads) {
    const std::shared_ptr<Session> session =
        create_backend("cpu", {.cpu = {.threads = threads, .storage = Storage::int16}})
            .backend->prepare({volume, views, {}, {}});
    return {"raylign cpu, int16 voxels", [session](const ViewGeometry&, const RigidTransform& pose) {
                Timing timing = make_timing("", 1);
                Image image = render_own(*session, pose, 0, timing);
                return TimedImage{std::move(image), timing.seconds.front()};
            }};
}

/// Runs all programs in turn on each pose. timings: raylign's, then one per peer.
void measure_round(Session& session, const ViewGeometry& view, const std::vector<Peer>& peers,
                   const std::vector<RigidTransform>& poses, std::vector<Timing>& timings) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
        const Image own = render_own(session, poses[i], i, timings[0]);
        for (std::size_t p = 0; p < peers.size(); ++p) {
            const TimedImage other = peers[p].render(view, poses[i]);
            Timing& timing = timings[p + 1];
            timing.seconds[i] = std::min(timing.seconds[i], other.seconds);
            compare(other.image, own, timing);
        }
    }
}

bool same_images(const Timing& t) {
    return std::ranges::min(t.correlation) > kLeastCorrelation &&
           std::ranges::max(t.mean_difference) < kLargestMeanDifference;
}

std::vector<double> ratios(const std::vector<double>& slow, const std::vector<double>& fast) {
    std::vector<double> ratio;
    std::ranges::transform(slow, fast, std::back_inserter(ratio), std::divides());
    return ratio;
}

void print_table(const std::vector<Timing>& timings, Record& record) {
    std::printf(
        "| program | ms, median | least | most | raylign is faster, median (range) | its first render | correlation | "
        "mean difference | largest difference |\n|---|---|---|---|---|---|---|---|---|\n");
    const Timing& own = timings.front();
    std::printf("| %s | %.2f | %.2f | %.2f | | (%.2f ms) | | | |\n", own.name.c_str(), 1e3 * median(own.seconds),
                1e3 * std::ranges::min(own.seconds), 1e3 * std::ranges::max(own.seconds), 1e3 * median(own.cold_s));
    record.add({own.name, 1e3 * median(own.seconds), 1, 1, 1, 1, "", ""});
    for (auto t = timings.begin() + 1; t != timings.end(); ++t) {
        const std::vector<double> ratio = ratios(t->seconds, own.seconds);
        std::printf("| %s | %.1f | %.1f | %.1f | %.1f x (%.1f-%.1f) | %.1f x | %.6f | %.1e | %.1e |%s\n",
                    t->name.c_str(), 1e3 * median(t->seconds), 1e3 * std::ranges::min(t->seconds),
                    1e3 * std::ranges::max(t->seconds), median(ratio), std::ranges::min(ratio), std::ranges::max(ratio),
                    median(ratios(t->seconds, own.cold_s)), std::ranges::min(t->correlation),
                    std::ranges::max(t->mean_difference), std::ranges::max(t->max_difference),
                    same_images(*t) ? "" : " IMAGES DISAGREE");
        record.add({t->name, 1e3 * median(t->seconds), median(ratio), std::ranges::min(ratio), std::ranges::max(ratio),
                    median(ratios(t->seconds, own.cold_s)), std::ranges::min(t->correlation),
                    std::ranges::max(t->max_difference)});
    }
}

struct Arguments {
    std::string volume;
    int pixels, threads, poses, rounds;
    double spread_deg;
};

void print_heading(const Arguments& a, const Eigen::Vector3i& size, const BackendInfo& info) {
    std::printf("%s: %d x %d x %d voxels, %d^2 pixels, %d threads, %d random poses (%.0f deg), %d rounds; %s, %s\n\n",
                a.volume.c_str(), size.x(), size.y(), size.z(), a.pixels, info.threads, a.poses, a.spread_deg, a.rounds,
                info.device.c_str(), info.instruction_set.c_str());
}

/// The detector sees 1.25 times the volume's longest side at the isocentre.
View make_view(const Volume& volume, int pixels) {
    const double field_mm = 1.25 * volume.grid.spacing_mm.cwiseProduct(volume.grid.size.cast<double>()).maxCoeff();
    return {"AP", test::c_arm_view(0, pixels, field_mm), {}, {}};
}

int run(const Arguments& arguments, Record& record) {
    if (arguments.pixels < 1 || arguments.threads < 1 || arguments.poses < 1 || arguments.rounds < 1) {
        throw Error("pixels, threads, poses and rounds must be positive");
    }
    const Volume volume = make_volume(arguments.volume);
    const std::vector<View> views = {make_view(volume, arguments.pixels)};
    const TemporaryFolder folder;
    write_volume(folder.path / "volume.mha", volume);
    const std::vector<Peer> peers = {int16_peer(volume, views, arguments.threads),
                                     plastimatch_peer(folder.path / "volume.mha", arguments.threads),
                                     itk_peer(volume, arguments.threads)};
    const auto backend = create_backend("cpu", {.cpu = {.threads = arguments.threads}}).backend;
    const auto session = backend->prepare({volume, views, {}, {}});
    const std::vector<RigidTransform> poses = random_poses(arguments.poses, arguments.spread_deg);
    for (const RigidTransform& pose : poses) (void)session->render(pose, 0);  // makes the layouts that the poses need

    std::vector<Timing> timings = {make_timing("raylign cpu, joseph", poses.size())};
    for (const Peer& peer : peers) timings.push_back(make_timing(peer.name, poses.size()));
    for (int round = 0; round < arguments.rounds; ++round) {
        measure_round(*session, views[0].geometry, peers, poses, timings);
    }
    print_heading(arguments, volume.grid.size, backend->info());
    print_table(timings, record);
    // A fast wrong answer is not a result.
    if (!std::all_of(timings.begin() + 1, timings.end(), same_images)) return 1;
    record.note(backend->info().device + ", " + backend->info().instruction_set);
    record.write();
    return 0;
}

}  // namespace
}  // namespace raylign::detail::bench

int main(int argc, char** argv) {
    const auto number = [&](int i, double fallback) { return argc > i ? std::atof(argv[i]) : fallback; };
    return raylign::detail::bench::run_program("raylign_peers", [&] {
        raylign::detail::bench::Record record(
            argc, argv, "DRRs of other programs",
            {"program", "DRR, median [ms]", "times raylign's, median", "least", "most", "times its first render",
             "correlation", "largest difference, of the maximum"});
        const raylign::detail::bench::Arguments arguments{.volume = argc > 1 ? argv[1] : "256",
                                                          .pixels = static_cast<int>(number(2, 256)),
                                                          .threads = static_cast<int>(number(3, 2)),
                                                          .poses = static_cast<int>(number(4, 21)),
                                                          .rounds = static_cast<int>(number(6, 3)),
                                                          .spread_deg = number(5, 180)};
        return raylign::detail::bench::run(arguments, record);
    });
}
