#include "core/io/meshes/mesh_edges.h"

#include <algorithm>
#include <cstdlib>
#include <unordered_map>

namespace raylign::detail {
namespace {

using Triangle = TriangleMesh::Triangle;

std::uint64_t edge_key(std::int32_t a, std::int32_t b) {
    const auto [low, high] = std::minmax(a, b);
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(low)) << 32U | static_cast<std::uint32_t>(high);
}

/// A triangle's edge seen from its neighbour: whether it runs from the lower vertex to the higher.
struct EdgeUse {
    std::int32_t triangle;
    bool is_upwards;
};

std::unordered_map<std::uint64_t, std::vector<EdgeUse>> edges_of(const TriangleMesh& mesh) {
    std::unordered_map<std::uint64_t, std::vector<EdgeUse>> edges;
    edges.reserve(mesh.triangles.size() * 2);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::int32_t a = mesh.triangles[i][k], b = mesh.triangles[i][(k + 1) % 3];
            edges[edge_key(a, b)].push_back({static_cast<std::int32_t>(i), a < b});
        }
    }
    return edges;
}

/// Marks the part around `seed`; returns false where its triangles cannot agree.
bool walk_part(const std::vector<std::vector<std::pair<std::int32_t, bool>>>& neighbours, std::int32_t seed,
               MeshParts& parts) {
    std::vector<std::int32_t> members, todo{seed};
    std::size_t against = 0;
    bool agrees = true;
    parts.part_of[static_cast<std::size_t>(seed)] = parts.count;
    while (!todo.empty()) {
        const auto at = static_cast<std::size_t>(todo.back());
        todo.pop_back();
        members.push_back(static_cast<std::int32_t>(at));
        against += parts.is_against[at] ? 1 : 0;
        for (const auto& [other, contradicts] : neighbours[at]) {
            const auto o = static_cast<std::size_t>(other);
            const bool is_against = parts.is_against[at] != contradicts;
            if (parts.part_of[o] < 0) {
                parts.part_of[o] = parts.count;
                parts.is_against[o] = is_against;
                todo.push_back(other);
            } else if (parts.is_against[o] != is_against) {
                agrees = false;
            }
        }
    }
    if (2 * against > members.size()) {
        for (const std::int32_t i : members) {
            const auto m = static_cast<std::size_t>(i);
            parts.is_against[m] = !parts.is_against[m];
        }
    }
    return agrees;
}

}  // namespace

std::vector<MeshLoop> open_loops(const TriangleMesh& mesh) {
    std::unordered_map<std::int32_t, std::vector<std::int32_t>> missing;  // where the closing triangles' edges lead
    std::vector<std::int32_t> begins;
    for (const auto& [key, uses] : edges_of(mesh)) {
        const auto low = static_cast<std::int32_t>(key >> 32U), high = static_cast<std::int32_t>(key & 0xffffffffU);
        int upwards = 0;
        for (const EdgeUse& use : uses) upwards += use.is_upwards ? 1 : -1;
        const auto [from, to] = upwards > 0 ? std::pair(high, low) : std::pair(low, high);
        for (int n = std::abs(upwards); n > 0; --n) {
            missing[from].push_back(to);
            begins.push_back(from);
        }
    }
    std::ranges::sort(begins);  // the same loops however the table is ordered
    for (auto& [from, to] : missing) std::ranges::sort(to);
    std::vector<MeshLoop> loops;
    for (const std::int32_t begin : begins) {
        MeshLoop loop;
        for (std::int32_t at = begin; !missing[at].empty();) {
            loop.push_back(at);
            const std::int32_t next = missing[at].back();
            missing[at].pop_back();
            at = next;
        }
        if (!loop.empty()) loops.push_back(std::move(loop));
    }
    return loops;
}

MeshParts parts_of(const TriangleMesh& mesh) {
    const std::size_t count = mesh.triangles.size();
    std::vector<std::vector<std::pair<std::int32_t, bool>>> neighbours(count);  // and whether they contradict
    for (const auto& [key, uses] : edges_of(mesh)) {
        if (uses.size() != 2) continue;
        const bool contradicts = uses[0].is_upwards == uses[1].is_upwards;
        neighbours[static_cast<std::size_t>(uses[0].triangle)].emplace_back(uses[1].triangle, contradicts);
        neighbours[static_cast<std::size_t>(uses[1].triangle)].emplace_back(uses[0].triangle, contradicts);
    }
    MeshParts parts{std::vector<int>(count, -1), std::vector<bool>(count), 0, false};
    for (std::size_t i = 0; i < count; ++i) {
        if (parts.part_of[i] >= 0) continue;
        if (!walk_part(neighbours, static_cast<std::int32_t>(i), parts)) parts.is_one_sided = true;
        ++parts.count;
    }
    return parts;
}

}  // namespace raylign::detail
