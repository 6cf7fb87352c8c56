#include "flux/tracer/repair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "flux/lateral.hpp"
#include "surface/error.hpp"
#include "surface/ray_scene.hpp"
#include "surface/topology.hpp"

namespace sidewall::flux {
namespace {

std::size_t single_edges(const TriangleMesh& mesh) {
    const surface::EdgeTable table = surface::edge_table(mesh);
    std::size_t count = 0;
    for (std::size_t e = 0; e < table.edges.size(); ++e) count += table.corners[e].size() == 1;
    return count;
}

// By vertex, the first one of the same position.
std::vector<std::uint32_t> first_of_position(const TriangleMesh& mesh) {
    const auto key = [&](std::uint32_t v) {
        const Vec3& p = mesh.vertices[v];
        return std::array{p.x(), p.y(), p.z()};
    };
    std::vector<std::uint32_t> order(mesh.vertices.size()), first(order.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
    return first;
}

// Keeps the values of the elements in \p kept, in its order.
void keep(std::vector<Attribute>& attributes, const std::vector<std::uint32_t>& kept) {
    for (Attribute& attribute : attributes) {
        const auto n = static_cast<std::size_t>(attribute.components);
        std::vector<double> values;
        for (const std::uint32_t i : kept)
            for (std::size_t k = 0; k < n; ++k) values.push_back(attribute.values[n * i + k]);
        attribute.values = std::move(values);
    }
}

// The mesh with every vertex v replaced by first[v], and without those that no triangle names then.
TriangleMesh merged(const TriangleMesh& mesh, const std::vector<std::uint32_t>& first) {
    std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) used[first[v]] = 1;
    TriangleMesh result;
    result.triangle_attributes = mesh.triangle_attributes;
    result.vertex_attributes = mesh.vertex_attributes;
    std::vector<std::uint32_t> kept, number(mesh.vertices.size());
    for (std::uint32_t v = 0; v < used.size(); ++v) {
        if (!used[v]) continue;
        number[v] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(v);
        result.vertices.push_back(mesh.vertices[v]);
    }
    keep(result.vertex_attributes, kept);
    for (const auto& [a, b, c] : mesh.triangles)
        result.triangles.push_back({number[first[a]], number[first[b]], number[first[c]]});
    return result;
}

std::size_t drop_unused(TriangleMesh& mesh) {
    std::vector<std::uint32_t> itself(mesh.vertices.size());
    std::iota(itself.begin(), itself.end(), 0u);
    TriangleMesh used = merged(mesh, itself);
    const std::size_t dropped = mesh.vertices.size() - used.vertices.size();
    if (dropped > 0) mesh = std::move(used);
    return dropped;
}

std::size_t weld(TriangleMesh& mesh) {
    const std::size_t loose = single_edges(mesh);
    if (loose == 0) return 0;
    TriangleMesh whole = merged(mesh, first_of_position(mesh));
    const std::size_t welded = mesh.vertices.size() - whole.vertices.size();
    if (welded == 0 || single_edges(whole) >= loose) return 0;
    mesh = std::move(whole);
    return welded;
}

std::size_t drop_repeated(TriangleMesh& mesh) {
    const auto key = [&](std::uint32_t t) {
        Triangle vertices = mesh.triangles[t];
        std::sort(vertices.begin(), vertices.end());
        return vertices;
    };
    std::vector<std::uint32_t> order(mesh.triangles.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    std::vector<std::uint8_t> repeated(order.size(), 0);
    for (std::size_t i = 1; i < order.size(); ++i) repeated[order[i]] = key(order[i]) == key(order[i - 1]);
    std::vector<std::uint32_t> kept;
    std::vector<Triangle> triangles;
    for (std::uint32_t t = 0; t < repeated.size(); ++t) {
        if (repeated[t]) continue;
        kept.push_back(t);
        triangles.push_back(mesh.triangles[t]);
    }
    const std::size_t dropped = mesh.triangles.size() - triangles.size();
    if (dropped == 0) return 0;
    mesh.triangles = std::move(triangles);
    keep(mesh.triangle_attributes, kept);
    return dropped;
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

// Triangles that are connected, and whether their orientations agree.
struct Piece {
    std::vector<std::uint32_t> triangles;
    bool agrees = true, open = false;
};

void turn_over(TriangleMesh& mesh, std::uint32_t t) {
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
}

// Turns triangles over until every piece agrees with its first one. \p turned: one flag a triangle.
std::vector<Piece> make_agree(TriangleMesh& mesh, std::vector<std::uint8_t>& turned) {
    const auto across = neighbours(mesh);
    std::vector<std::uint8_t> reached(mesh.triangles.size(), 0);
    std::vector<Piece> pieces;
    for (std::uint32_t seed = 0; seed < reached.size(); ++seed) {
        if (reached[seed]) continue;
        Piece piece;
        piece.triangles = {seed};
        reached[seed] = 1;
        for (std::size_t i = 0; i < piece.triangles.size(); ++i) {
            const std::uint32_t t = piece.triangles[i];
            piece.open |= across[t].size() < 3;
            for (const auto& [other, opposed] : across[t]) {
                const auto wanted = static_cast<std::uint8_t>(turned[t] ^ (opposed ? 1 : 0));
                piece.agrees &= !opposed;
                if (!reached[other]) {
                    reached[other] = 1;
                    turned[other] = wanted;
                    piece.triangles.push_back(other);
                } else if (turned[other] != wanted) {
                    const Vec3 c = triangle_centroid(mesh, other);
                    throw GeometryError(fmt::format(
                        "the surface has one side only: around triangle {} at ({:.6g}, {:.6g}, {:.6g}) no "
                        "orientation fits all triangles; repair the mesh",
                        other, c.x(), c.y(), c.z()));
                }
            }
        }
        pieces.push_back(std::move(piece));
    }
    for (std::uint32_t t = 0; t < turned.size(); ++t)
        if (turned[t]) turn_over(mesh, t);
    return pieces;
}

// Areas, projected along z, of a piece's triangles whose middle is the first hit from straight above.
struct Seen {
    double front = 0.0, back = 0.0;
};

Seen seen_from_above(const TriangleMesh& mesh, const surface::RayScene& scene, const Piece& piece) {
    constexpr std::size_t kSamples = 1024;
    const std::size_t stride = (piece.triangles.size() + kSamples - 1) / kSamples;
    const double above = scene.top() + 1.0;
    Seen seen;
    for (std::size_t i = 0; i < piece.triangles.size(); i += stride) {
        const std::uint32_t t = piece.triangles[i];
        const double area = area_vector(mesh, t).z();
        const Vec3 c = triangle_centroid(mesh, t);
        const auto hit = scene.closest_hit({c.x(), c.y(), above}, -Vec3::UnitZ(), 0.0, above - c.z() + 1.0);
        if (hit.triangle == t) (area > 0.0 ? seen.front : seen.back) += std::abs(area);
    }
    return seen;
}

// Whether a piece that nothing above shows is the better way round with all its triangles reversed.
bool better_reversed(const TriangleMesh& mesh, const Piece& piece, const std::vector<std::uint8_t>& turned) {
    if (piece.agrees) return false;
    double kept = 0.0, changed = 0.0, upwards = 0.0, volume = 0.0;
    for (const std::uint32_t t : piece.triangles) {
        (turned[t] ? changed : kept) += triangle_area(mesh, t);
        upwards += area_vector(mesh, t).z();
        volume += area_vector(mesh, t).dot(mesh.vertices[mesh.triangles[t][0]]);
    }
    if (kept >= 2.0 * changed) return false;
    if (changed >= 2.0 * kept) return true;
    return (piece.open ? upwards : volume) < 0.0;
}

std::size_t orient(TriangleMesh& mesh) {
    std::vector<std::uint8_t> turned(mesh.triangles.size(), 0);
    const std::vector<Piece> pieces = make_agree(mesh, turned);
    const surface::RayScene scene(mesh);
    for (const Piece& piece : pieces) {
        const auto [front, back] = seen_from_above(mesh, scene, piece);
        if (std::min(front, back) > 0.25 * (front + back)) {
            const Vec3 c = triangle_centroid(mesh, piece.triangles.front());
            throw GeometryError(fmt::format(
                "from above, the piece of the surface around ({:.6g}, {:.6g}, {:.6g}) shows its front in "
                "some places and its back in others: it does not tell which side is the material's; close "
                "the mesh, or cut away what is open to behind",
                c.x(), c.y(), c.z()));
        }
        if (front + back > 0.0 ? back <= front : !better_reversed(mesh, piece, turned)) continue;
        for (const std::uint32_t t : piece.triangles) {
            turn_over(mesh, t);
            turned[t] ^= 1;
        }
    }
    return static_cast<std::size_t>(std::count(turned.begin(), turned.end(), 1));
}

}  // namespace

Repairs repair(TriangleMesh& mesh) {
    require_traceable(mesh);
    Repairs done;
    done.unused = drop_unused(mesh);
    done.welded = weld(mesh);
    done.repeated = drop_repeated(mesh);
    done.turned = orient(mesh);
    return done;
}

}  // namespace sidewall::flux
