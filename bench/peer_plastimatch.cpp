#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include "bench/peers.h"
#include "core/base/error.h"

namespace raylign::detail::bench {
namespace {

/// `-s 10` undoes plastimatch's division of the line integral by 10.
std::string drr_command(const std::filesystem::path& volume_file, const std::string& prefix, int threads,
                        const ViewGeometry& view, const RigidTransform& world_from_ct) {
    const RigidTransform camera_from_ct = view.camera_from_world * world_from_ct;
    const Eigen::Vector3d source_ct = inverse(camera_from_ct).translation_mm;
    // Rows of the rotation: the camera's axes in ct. plastimatch's normal points from the detector to the source, its
    // "up" to the image's top row, its isocentre lies sad in front of the source on the normal. Image centre: its
    // default, (size - 1) / 2.
    const Eigen::RowVector3d down = camera_from_ct.rotation.row(1), forth = camera_from_ct.rotation.row(2);
    const double sad_mm = view.camera_from_world.translation_mm.z();
    const Eigen::Vector3d isocentre = source_ct + sad_mm * forth.transpose();
    const Eigen::Vector2d size_mm = view.camera.pixel_pitch_mm()->cwiseProduct(view.camera.size_px.cast<double>());
    std::ostringstream out;
    out.precision(12);
    out << "OMP_NUM_THREADS=" << threads << " plastimatch drr -i exact -A cpu -P none -s 10 -t pfm"
        << " --nrm '" << -forth << "' --vup '" << -down << "' -o '" << isocentre.transpose() << "' --sad " << sad_mm
        << " --sid " << *view.camera.sdd_mm << " -z '" << size_mm.y() << " " << size_mm.x() << "' -r '"
        << view.camera.size_px.y() << " " << view.camera.size_px.x() << "' -I '" << volume_file.string() << "' -O '"
        << prefix << "' 2>&1";
    return out.str();
}

std::string output_of(const std::string& command) {
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
    if (!pipe) throw Error("cannot run: " + command, ErrorKind::unavailable);
    std::string output;
    char buffer[256];
    while (std::fgets(buffer, sizeof buffer, pipe.get())) output += buffer;
    return output;
}

double number_after(const std::string& output, const char* label, const std::string& command) {
    const std::size_t at = output.find(label);
    if (at == std::string::npos) {
        throw Error(std::string("no \"") + label + "\" in the output of: " + command + "\n" + output,
                    ErrorKind::unavailable);
    }
    return std::stod(output.substr(at + std::strlen(label)));
}

/// plastimatch's PFM: "Pf", columns, rows, -1, then little-endian floats, top row first (the PFM format says bottom
/// row first).
Image read_pfm(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string magic;
    int width = 0, height = 0;
    double scale = 0;
    file >> magic >> width >> height >> scale;
    file.get();
    if (!file || magic != "Pf" || width < 1 || height < 1) throw Error("not a PFM image: " + path);
    Image image(width, height);
    file.read(reinterpret_cast<char*>(image.pixels.data()),
              static_cast<std::streamsize>(image.pixels.size() * sizeof(float)));
    if (!file) throw Error("PFM image is too short: " + path);
    return image;
}

}  // namespace

Peer plastimatch_peer(const std::filesystem::path& volume_file, int threads) {
    const std::string prefix = (volume_file.parent_path() / "plastimatch_").string();
    const auto render = [=](const ViewGeometry& view, const RigidTransform& world_from_ct) {
        const std::string command = drr_command(volume_file, prefix, threads, view, world_from_ct);
        const std::string output = output_of(command);
        const double seconds =
            number_after(output, "Total time:", command) - number_after(output, "I/O time:", command);
        return TimedImage{read_pfm(prefix + "0000.pfm"), seconds};
    };
    return {"plastimatch exact", render};
}

}  // namespace raylign::detail::bench
