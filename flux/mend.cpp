#include "flux/mend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "flux/lateral.hpp"
#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::flux {
namespace {

std::size_t single_edges(const TriangleMesh& mesh) {
    const surface::EdgeTable table = surface::edge_table(mesh);
    std::size_t count = 0;
    for (std::size_t e = 0; e < table.edges.size(); ++e) count += table.corners[e].size() == 1;
    return count;
}

// The mesh with vertices of equal position merged into the first of them.
TriangleMesh welded(const TriangleMesh& mesh) {
    const auto key = [&](std::uint32_t v) {
        const Vec3& p = mesh.vertices[v];
        return std::array{p.x(), p.y(), p.z()};
    };
    std::vector<std::uint32_t> order(mesh.vertices.size()), first(order.size()), number(order.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
    TriangleMesh result;
    result.triangle_attributes = mesh.triangle_attributes;
    result.vertex_attributes = mesh.vertex_attributes;
    for (Attribute& attribute : result.vertex_attributes) attribute.values.clear();
    for (std::uint32_t v = 0; v < first.size(); ++v) {
        if (first[v] != v) continue;
        number[v] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[v]);
        for (std::size_t a = 0; a < mesh.vertex_attributes.size(); ++a) {
            const Attribute& from = mesh.vertex_attributes[a];
            const auto n = static_cast<std::size_t>(from.components);
            for (std::size_t k = 0; k < n; ++k)
                result.vertex_attributes[a].values.push_back(from.values[n * v + k]);
        }
    }
    for (const Triangle& t : mesh.triangles)
        result.triangles.push_back({number[first[t[0]]], number[first[t[1]]], number[first[t[2]]]});
    return result;
}

// A triangle across an edge, and whether both run along it in the same direction.
struct Neighbour {
    std::uint32_t triangle;
    bool opposed;
};

std::vector<std::vector<Neighbour>> neighbours(const TriangleMesh& mesh) {
    const surface::EdgeTable table = surface::edge_table(mesh);
    std::vector<std::vector<Neighbour>> across(mesh.triangles.size());
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto corners = table.corners[e];
        if (corners.size() != 2) continue;
        const auto start = [&](std::uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
        const bool opposed = start(corners[0]) == start(corners[1]);
        across[corners[0] / 3].push_back({corners[1] / 3, opposed});
        across[corners[1] / 3].push_back({corners[0] / 3, opposed});
    }
    return across;
}

// Whether a piece is the better way round with all its triangles reversed. \p turn: reversed to agree with
// the first.
bool better_reversed(const TriangleMesh& mesh, const std::vector<std::uint32_t>& piece,
                     const std::vector<std::int8_t>& turn, bool open) {
    double kept = 0.0, reversed = 0.0, upwards = 0.0, volume = 0.0;
    for (const std::uint32_t t : piece) {
        (turn[t] > 0 ? reversed : kept) += triangle_area(mesh, t);
        const double sign = turn[t] > 0 ? -1.0 : 1.0;
        upwards += sign * area_vector(mesh, t).z();
        volume += sign * area_vector(mesh, t).dot(mesh.vertices[mesh.triangles[t][0]]);
    }
    if (kept >= 2.0 * reversed) return false;
    if (reversed >= 2.0 * kept) return true;
    return (open ? upwards : volume) < 0.0;
}

std::size_t orient(TriangleMesh& mesh) {
    const auto across = neighbours(mesh);
    std::vector<std::int8_t> turn(mesh.triangles.size(), -1);  // not yet reached
    std::size_t turned = 0;
    for (std::uint32_t seed = 0; seed < turn.size(); ++seed) {
        if (turn[seed] >= 0) continue;
        std::vector<std::uint32_t> piece{seed};
        turn[seed] = 0;
        bool agrees = true, open = false;
        for (std::size_t i = 0; i < piece.size(); ++i) {
            const std::uint32_t t = piece[i];
            open |= across[t].size() < 3;
            for (const auto& [other, opposed] : across[t]) {
                const auto wanted = static_cast<std::int8_t>(opposed ? 1 - turn[t] : turn[t]);
                agrees &= !opposed;
                if (turn[other] < 0) {
                    turn[other] = wanted;
                    piece.push_back(other);
                } else if (turn[other] != wanted) {
                    const Vec3 c = triangle_centroid(mesh, other);
                    throw GeometryError(fmt::format(
                        "the surface has one side only: around triangle {} at ({:.6g}, {:.6g}, {:.6g}) no "
                        "orientation fits all triangles; repair the mesh",
                        other, c.x(), c.y(), c.z()));
                }
            }
        }
        if (agrees) continue;
        const bool reverse = better_reversed(mesh, piece, turn, open);
        for (const std::uint32_t t : piece)
            if ((turn[t] > 0) != reverse) {
                std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
                ++turned;
            }
    }
    return turned;
}

}  // namespace

Mending mend(TriangleMesh& mesh) {
    require_traceable(mesh);
    Mending mending;
    const std::size_t loose = single_edges(mesh);
    if (loose > 0) {
        TriangleMesh whole = welded(mesh);
        if (whole.vertices.size() < mesh.vertices.size() && single_edges(whole) < loose) {
            mending.welded = mesh.vertices.size() - whole.vertices.size();
            mesh = std::move(whole);
        }
    }
    mending.turned = orient(mesh);
    return mending;
}

}  // namespace sidewall::flux
