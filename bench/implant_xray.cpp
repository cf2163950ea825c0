#include "bench/implant_xray.h"

#include <algorithm>
#include <cmath>

#include "bench/exact_lengths.h"
#include "core/geometry/camera.h"
#include "core/image/saturation.h"
#include "raylign/io/views.h"
#include "raylign/xray.h"

namespace raylign::detail::bench {
namespace {

constexpr int kSamples = 3;

/// Line integrals of lumps, from some pixels to a quarter of the image wide.
Image tissue(const Eigen::Vector2i& size_px, double strength, Random& random) {
    constexpr int kLumps = 40;
    Image image(size_px.x(), size_px.y(), static_cast<float>(strength));
    for (int k = 0; k < kLumps; ++k) {
        const double sigma = size_px.x() * 0.25 * std::pow(0.05, random.uniform());
        const double x0 = random.uniform(0, size_px.x()), y0 = random.uniform(0, size_px.y());
        const double height = 0.3 * strength * random.normal();
        const int reach = static_cast<int>(3 * sigma);
        const int y_end = std::min(size_px.y(), static_cast<int>(y0) + reach);
        const int x_end = std::min(size_px.x(), static_cast<int>(x0) + reach);
        for (int y = std::max(0, static_cast<int>(y0) - reach); y < y_end; ++y) {
            for (int x = std::max(0, static_cast<int>(x0) - reach); x < x_end; ++x) {
                const double r2 = (x - x0) * (x - x0) + (y - y0) * (y - y0);
                image(x, y) += static_cast<float>(height * std::exp(-r2 / (2 * sigma * sigma)));
            }
        }
    }
    for (float& pixel : image.pixels) pixel = std::max(pixel, 0.F);
    return image;
}

}  // namespace

RigidTransform moved(const RigidTransform& pose, const Eigen::Vector3d& centre_mm, double most_mm, double most_deg,
                     Random& random) {
    const Eigen::Vector3d axis = random.direction(), direction = random.direction();
    Twist twist;
    twist << axis * random.uniform(0, most_deg) * kDegree, direction * most_mm * std::cbrt(random.uniform());
    return exp_about(twist, centre_mm) * pose;
}

RawXray counts_of(const TriangleMesh& mesh, double mu_per_mm, const ViewGeometry& view, const RigidTransform& pose,
                  const ImplantXray& settings, int seed) {
    ViewGeometry fine = view;
    fine.camera = finer(view.camera, kSamples);
    const Image lengths = exact_lengths(mesh, fine, pose);
    Random random(static_cast<std::uint64_t>(seed) + 1000);
    const Image body = tissue(view.camera.size_px, settings.tissue, random);
    const Eigen::Vector2d pitch_mm = view.camera.pixel_pitch_mm().value();
    XrayExposure exposure;
    exposure.samples_per_pixel = kSamples;
    exposure.sample_pitch_mm = pitch_mm / kSamples;
    exposure.energy = lengths;
    for (int y = 0; y < lengths.height; ++y) {
        for (int x = 0; x < lengths.width; ++x) {
            const double integral = mu_per_mm * std::max(0.F, lengths(x, y)) + body(x / kSamples, y / kSamples);
            exposure.energy(x, y) = static_cast<float>(std::exp(-integral));
        }
    }
    exposure.energy_squared = exposure.energy;
    exposure.photons_per_sample = settings.photons_per_mm2 * exposure.sample_pitch_mm.prod();
    XrayModel model;
    model.name = "implant";
    model.blur_mm = settings.blur_mm;
    model.floor_share = settings.floor_share;
    model.bits = settings.bits;
    model.full_scale = std::exp(-0.3 * settings.tissue);
    RawXray counts = detected(model, exposure, static_cast<std::uint64_t>(seed));
    const auto share = [&](double of_largest) {
        return static_cast<float>(std::round(of_largest * counts.max_representable));
    };
    for (float& pixel : counts.image.pixels)
        pixel = std::max({pixel - share(settings.black), share(settings.clip), 0.F});
    return counts;
}

IntensitySettings counts_read_as() {
    IntensitySettings intensity;
    intensity.kind = IntensityKind::transmission;
    intensity.polarity = Polarity::bone_dark;
    return intensity;
}

View shown_on(const TriangleMesh& mesh, double mu_per_mm, View view, const RigidTransform& pose,
              const ImplantXray& settings, int seed) {
    XrayConversion read = line_integral_from_xray(counts_of(mesh, mu_per_mm, view.geometry, pose, settings, seed), {},
                                                  counts_read_as(), "simulated");
    view.image = std::move(read.line_integral);
    view.weights = std::move(read.weights);
    const std::optional<Saturation> saturation = find_saturation(view.image, view.weights);
    if (saturation) view.ceiling = saturation->ceiling;
    return view;
}

}  // namespace raylign::detail::bench
