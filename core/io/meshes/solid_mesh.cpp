#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/io/meshes/mesh_edges.h"
#include "core/io/meshes/triangle_mesh.h"

namespace raylign::detail {
namespace {

constexpr double kJoined = 1e-5;  // of the largest side: rounding of text files with six digits
constexpr double kFarthest_mm = 1e6;
constexpr double kLargestHole = 0.05;  // of the surface: what is guessed there matters less than a voxel's rim

using Triangle = TriangleMesh::Triangle;

void check_finite(const TriangleMesh& mesh, const std::string& where) {
    if (mesh.triangles.empty()) throw Error(where + " has no triangles: nothing to register");
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (const std::int32_t corner : mesh.triangles[i]) {
            const Eigen::Vector3d& v = mesh.vertices_mm.at(static_cast<std::size_t>(corner));
            if (v.allFinite() && v.cwiseAbs().maxCoeff() < kFarthest_mm) continue;
            throw bad_value("triangle " + std::to_string(i + 1), "a corner that is NaN, infinite or 1 km away",
                            "finite", where);
        }
    }
}

/// Joins vertices that lie in one cell of this size, or in neighbouring ones and closer than it. 0 = equal ones.
std::size_t join_vertices(TriangleMesh& mesh, double within_mm) {
    using Cell = std::array<std::int64_t, 3>;
    std::map<Cell, std::vector<std::int32_t>> cells;
    std::vector<Eigen::Vector3d> kept;
    std::vector<std::int32_t> place(mesh.vertices_mm.size());
    const double cell_mm = within_mm > 0 ? within_mm : 1e-3;
    const int reach = within_mm > 0 ? 1 : 0;
    for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) {
        const Eigen::Vector3d& v = mesh.vertices_mm[i];
        Cell home{};
        for (int a = 0; a < 3; ++a) home[static_cast<std::size_t>(a)] = std::llround(std::floor(v[a] / cell_mm));
        std::int32_t found = -1;
        for (int n = 0; n < 27 && found < 0; ++n) {
            const Cell cell{home[0] + n % 3 - 1, home[1] + n / 3 % 3 - 1, home[2] + n / 9 - 1};
            if (reach == 0 && cell != home) continue;
            const auto there = cells.find(cell);
            if (there == cells.end()) continue;
            for (const std::int32_t other : there->second) {
                if ((kept[static_cast<std::size_t>(other)] - v).norm() <= within_mm) found = other;
            }
        }
        if (found < 0) {
            found = static_cast<std::int32_t>(kept.size());
            kept.push_back(v);
            cells[home].push_back(found);
        }
        place[i] = found;
    }
    const std::size_t joined = mesh.vertices_mm.size() - kept.size();
    mesh.vertices_mm = std::move(kept);
    for (Triangle& triangle : mesh.triangles) {
        for (std::int32_t& corner : triangle) corner = place[static_cast<std::size_t>(corner)];
    }
    return joined;
}

/// Triangles with two equal corners, and those that are there already with the same face outwards.
void drop_empty_and_copies(TriangleMesh& mesh, std::vector<std::string>& notes) {
    std::set<Triangle> seen;
    std::size_t copies = 0;
    std::vector<Triangle> kept;
    for (const Triangle& triangle : mesh.triangles) {
        if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
        Triangle key = triangle;
        std::rotate(key.begin(), std::ranges::min_element(key), key.end());
        if (seen.insert(key).second) {
            kept.push_back(triangle);
        } else {
            ++copies;
        }
    }
    mesh.triangles = std::move(kept);
    if (copies > 0) notes.push_back(std::to_string(copies) + " triangles stood twice and count once");
}

double area_mm2(const TriangleMesh& mesh, const Triangle& t) {
    const auto at = [&](int i) { return mesh.vertices_mm[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])]; };
    return (at(1) - at(0)).cross(at(2) - at(0)).norm() / 2;
}

double area_mm2(const TriangleMesh& mesh) {
    double sum = 0;
    for (const Triangle& triangle : mesh.triangles) sum += area_mm2(mesh, triangle);
    return sum;
}

/// Closes each hole by triangles from its rim to its centre.
void close_holes(TriangleMesh& mesh, const std::string& where, std::vector<std::string>& notes) {
    const std::vector<MeshLoop> holes = open_loops(mesh);
    if (holes.empty()) return;
    const double surface_mm2 = area_mm2(mesh);
    double largest = 0, widest_mm = 0;
    for (const MeshLoop& hole : holes) {
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        for (const std::int32_t corner : hole) centre += mesh.vertices_mm[static_cast<std::size_t>(corner)];
        centre /= static_cast<double>(hole.size());
        const auto tip = static_cast<std::int32_t>(mesh.vertices_mm.size());
        mesh.vertices_mm.push_back(centre);
        double hole_mm2 = 0;
        for (std::size_t i = 0; i < hole.size(); ++i) {
            const Triangle triangle{hole[i], hole[(i + 1) % hole.size()], tip};
            mesh.triangles.push_back(triangle);
            hole_mm2 += area_mm2(mesh, triangle);
            widest_mm = std::max(widest_mm, 2 * (mesh.vertices_mm[static_cast<std::size_t>(hole[i])] - centre).norm());
        }
        largest = std::max(largest, hole_mm2 / surface_mm2);
    }
    const std::string found = std::to_string(holes.size()) + (holes.size() == 1 ? " hole" : " holes") +
                              ", the widest about " + fixed(widest_mm, 1) + " mm across";
    if (largest > kLargestHole) {
        throw Error(where + ": the surface is open (" + found + ", " + fixed(100 * largest, 0) +
                    " % of the surface): only a closed one has an inside; close it in the program that it comes from");
    }
    notes.push_back(found + ", closed by flat patches");
}

/// The winding number of all other parts about a point: 1 inside of one, 0 outside.
double winding_of_others(const TriangleMesh& mesh, const std::vector<int>& part_of, int part,
                         const Eigen::Vector3d& p) {
    double sum = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (part_of[i] == part) continue;
        std::array<Eigen::Vector3d, 3> r;
        for (std::size_t k = 0; k < 3; ++k) {
            r[k] = mesh.vertices_mm[static_cast<std::size_t>(mesh.triangles[i][k])] - p;
        }
        const double a = r[0].norm(), b = r[1].norm(), c = r[2].norm();
        sum += std::atan2(r[0].dot(r[1].cross(r[2])),
                          a * b * c + r[0].dot(r[1]) * c + r[1].dot(r[2]) * a + r[2].dot(r[0]) * b);
    }
    return sum / (2 * std::numbers::pi);  // [Oosterom83]: half the solid angle each
}

void turn(Triangle& triangle) { std::swap(triangle[1], triangle[2]); }

/// Turns what its neighbours contradict, then parts that are inside out.
void face_outwards(TriangleMesh& mesh, const std::string& where, std::vector<std::string>& notes) {
    const MeshParts parts = parts_of(mesh);
    if (parts.is_one_sided) throw Error(where + ": the surface is one-sided, as a Moebius strip: it has no inside");
    std::size_t turned = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (!parts.is_against[i]) continue;
        turn(mesh.triangles[i]);
        ++turned;
    }
    std::vector<double> volumes(static_cast<std::size_t>(parts.count));
    const Eigen::Vector3d origin = mesh.vertices_mm.front();
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        volumes[static_cast<std::size_t>(parts.part_of[i])] += six_volumes_mm3(mesh, mesh.triangles[i], origin) / 6;
    }
    std::size_t inside_out = 0;
    std::vector<bool> is_turned(volumes.size());
    for (std::size_t part = 0; part < volumes.size(); ++part) {
        if (volumes[part] >= 0) continue;
        const auto first = std::ranges::find(parts.part_of, static_cast<int>(part)) - parts.part_of.begin();
        const auto corner = static_cast<std::size_t>(mesh.triangles[static_cast<std::size_t>(first)][0]);
        const double winding = winding_of_others(mesh, parts.part_of, static_cast<int>(part), mesh.vertices_mm[corner]);
        is_turned[part] = winding < 0.5;
        inside_out += is_turned[part] ? 1 : 0;
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        if (is_turned[static_cast<std::size_t>(parts.part_of[i])]) turn(mesh.triangles[i]);
    }
    if (turned > 0) notes.push_back(std::to_string(turned) + " inverted triangles were turned as their neighbours are");
    if (inside_out > 0) {
        notes.push_back(std::to_string(inside_out) + " of " + std::to_string(volumes.size()) +
                        " surfaces were inside out and have been turned");
    }
}

}  // namespace

MeshBounds bounds_of(const TriangleMesh& mesh) {
    MeshBounds bounds{mesh.vertices_mm.front(), mesh.vertices_mm.front()};
    for (const Eigen::Vector3d& v : mesh.vertices_mm) {
        bounds.low_mm = bounds.low_mm.cwiseMin(v);
        bounds.high_mm = bounds.high_mm.cwiseMax(v);
    }
    return bounds;
}

double six_volumes_mm3(const TriangleMesh& mesh, const Triangle& triangle, const Eigen::Vector3d& origin_mm) {
    const auto at = [&](std::size_t i) -> Eigen::Vector3d {
        return mesh.vertices_mm[static_cast<std::size_t>(triangle[i])] - origin_mm;
    };
    return at(0).dot(at(1).cross(at(2)));
}

SolidMesh solid_of(TriangleMesh mesh, const std::string& where) {
    check_finite(mesh, where);
    SolidMesh solid;
    (void)join_vertices(mesh, 0);
    drop_empty_and_copies(mesh, solid.notes);
    const double join_mm = kJoined * bounds_of(mesh).largest_side_mm();
    if (!open_loops(mesh).empty() && join_mm > 0) {
        const std::size_t joined = join_vertices(mesh, join_mm);
        if (joined > 0) solid.notes.push_back(std::to_string(joined) + " vertices were joined to their neighbours");
        drop_empty_and_copies(mesh, solid.notes);
    }
    if (mesh.triangles.empty()) throw Error(where + " has no triangle with an area");
    face_outwards(mesh, where, solid.notes);
    const std::size_t before = mesh.triangles.size();
    close_holes(mesh, where, solid.notes);
    if (mesh.triangles.size() != before) face_outwards(mesh, where, solid.notes);  // now that volumes are right
    const Eigen::Vector3d origin = mesh.vertices_mm.front();
    for (const Triangle& triangle : mesh.triangles) solid.volume_mm3 += six_volumes_mm3(mesh, triangle, origin) / 6;
    const double box_mm3 = std::pow(bounds_of(mesh).largest_side_mm(), 3);
    if (!(solid.volume_mm3 > 1e-9 * box_mm3)) throw Error(where + ": the surface encloses no volume");
    solid.mesh = std::move(mesh);
    return solid;
}

}  // namespace raylign::detail
