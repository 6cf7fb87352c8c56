#include "surface/orientation.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "surface/error.hpp"
#include "surface/ray_scene.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

// A triangle across an edge; `opposed` if both run along it in one direction, so that one must be reversed.
struct Neighbour {
    std::uint32_t triangle;
    bool opposed;
};

std::vector<std::vector<Neighbour>> neighbours(const TriangleMesh& mesh) {
    const EdgeTable table = edge_table(mesh);
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

// A connected part of the surface; `open` if an edge has other than two triangles.
struct Piece {
    std::vector<std::uint32_t> triangles;
    bool open = false;
};

void turn_over(TriangleMesh& mesh, std::uint32_t t) {
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
}

// Reverses triangles until each piece is oriented as its first triangle; \p turned: 1 for those reversed.
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
                if (!reached[other]) {
                    reached[other] = 1;
                    turned[other] = wanted;
                    piece.triangles.push_back(other);
                } else if (turned[other] != wanted) {
                    const Vec3 c = triangle_centroid(mesh, other);
                    throw GeometryError(
                        "the surface has one side only: around triangle {} at ({:.6g}, {:.6g}, {:.6g}) no "
                        "orientation fits all triangles; repair the mesh",
                        other, c.x(), c.y(), c.z());
                }
            }
        }
        pieces.push_back(std::move(piece));
    }
    for (std::uint32_t t = 0; t < turned.size(); ++t)
        if (turned[t]) turn_over(mesh, t);
    return pieces;
}

// Visible area of a piece, by the face that it shows: twice the area, projected along z, of those sampled
// triangles whose centroid is the first hit of a ray from straight above.
struct Seen {
    double front = 0.0, back = 0.0;
};

Seen seen_from_above(const TriangleMesh& mesh, const RayScene& scene, const Piece& piece) {
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

// Whether a closed piece lies in gas: a ray up from its highest point hits nothing or a face pointing down.
bool lies_in_gas(const TriangleMesh& mesh, const RayScene& scene, const Piece& piece) {
    Vec3 highest = mesh.vertices[mesh.triangles[piece.triangles.front()][0]];
    for (const std::uint32_t t : piece.triangles)
        for (const std::uint32_t v : mesh.triangles[t])
            if (mesh.vertices[v].z() > highest.z()) highest = mesh.vertices[v];
    const double above = scene.top() - highest.z() + 1.0, least = 1e-5 * (bounding_box(mesh).size().norm());
    const auto hit = scene.closest_hit(highest, Vec3::UnitZ(), least, above);
    return !hit || area_vector(mesh, hit.triangle).z() < 0.0;
}

// Whether a piece that is hidden from above should be reversed as a whole. A piece whose triangles agreed
// from the start is kept, unless it is a closed body inside out (negative volume) that lies in gas. Any other
// piece takes the orientation of two thirds of its area; without such a majority a closed piece faces
// outwards, an open one upwards.
bool better_reversed(const TriangleMesh& mesh, const RayScene* scene, const Piece& piece,
                     const std::vector<std::uint8_t>& turned) {
    bool agreed = true;
    double kept = 0.0, changed = 0.0, upwards = 0.0, volume = 0.0;
    for (const std::uint32_t t : piece.triangles) {
        agreed &= turned[t] == 0;
        (turned[t] ? changed : kept) += triangle_area(mesh, t);
        upwards += area_vector(mesh, t).z();
        volume += area_vector(mesh, t).dot(mesh.vertices[mesh.triangles[t][0]]);
    }
    if (agreed) return scene && !piece.open && volume < 0.0 && lies_in_gas(mesh, *scene, piece);
    if (kept >= 2.0 * changed) return false;
    if (changed >= 2.0 * kept) return true;
    return (piece.open ? upwards : volume) < 0.0;
}

// Boundary edges, directed as a lid's triangles traverse them. Throws at edges of 3, 5, 7... triangles.
std::vector<Link> lid_edges(const TriangleMesh& mesh) {
    std::vector<Link> links;
    const EdgeTable table = edge_table(mesh);
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto corners = table.corners[e];
        const Triangle& t = mesh.triangles[corners[0] / 3];
        const std::uint32_t from = t[corners[0] % 3], to = t[(corners[0] + 1) % 3];
        if (corners.size() == 1) links.push_back({to, from});
        if (corners.size() == 1 || corners.size() % 2 == 0) continue;
        const Vec3 &p = mesh.vertices[from], &q = mesh.vertices[to];
        throw GeometryError(
            "{} triangles meet at the edge from ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g}): they do not tell "
            "inside from outside; take inner walls out of the mesh",
            corners.size(), p.x(), p.y(), p.z(), q.x(), q.y(), q.z());
    }
    return links;
}

// Per vertex, the area of the connected part of the mesh around it.
std::vector<double> connected_areas(const TriangleMesh& mesh) {
    DisjointSets sets(mesh.vertices.size());
    for (const auto& [a, b, c] : mesh.triangles) {
        sets.join(a, b);
        sets.join(b, c);
    }
    std::vector<double> area(mesh.vertices.size(), 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        area[sets.root(mesh.triangles[t][0])] += triangle_area(mesh, t);
    for (std::uint32_t v = 0; v < area.size(); ++v) area[v] = area[sets.root(v)];
    return area;
}

// Closes openings that options.closes() accepts by fans around the mean of their vertices; returns how many.
std::size_t close_openings(TriangleMesh& mesh, const RepairOptions& options) {
    constexpr double kLargest = 0.25, kNothing = 1e-12;  // shares of the area around an opening
    const std::vector<Link> links = lid_edges(mesh);
    if (links.empty()) return 0;
    const std::vector<double> areas = connected_areas(mesh);
    std::size_t closed = 0;
    for (const Chain& chain : join_links(links)) {
        std::vector<Vec3> rim;
        Vec3 middle = Vec3::Zero();
        for (const std::uint32_t k : chain.links) {
            rim.push_back(mesh.vertices[links[k].from]);
            middle += rim.back() / static_cast<double>(chain.links.size());
        }
        if (!options.closes(rim)) continue;
        mesh.vertex_attributes.clear();
        mesh.triangle_attributes.clear();
        const auto centre = static_cast<std::uint32_t>(mesh.vertices.size());
        mesh.vertices.push_back(middle);
        double lid = 0.0;
        const double area = areas[links[chain.links.front()].from];
        for (const std::uint32_t k : chain.links) {
            mesh.triangles.push_back(
                {static_cast<std::uint32_t>(links[k].from), static_cast<std::uint32_t>(links[k].to), centre});
            const double part = triangle_area(mesh, mesh.triangles.size() - 1);
            lid += part;
            if (part <= kNothing * area) mesh.triangles.pop_back();  // at a slit
        }
        if (!chain.closed || lid > kLargest * area)
            throw GeometryError(
                "the mesh is not closed: around ({:.6g}, {:.6g}, {:.6g}) it has an opening, {:.3g} of its area: "
                "close it, or let it reach the domain's sides",
                middle.x(), middle.y(), middle.z(), lid / area);
        ++closed;
    }
    return closed;
}

}  // namespace

void orient(TriangleMesh& mesh, const RepairOptions& options, Repairs& done) {
    std::vector<std::uint8_t> turned(mesh.triangles.size(), 0);
    std::vector<Piece> pieces = make_agree(mesh, turned);
    done.triangles = mesh.triangles.size();
    if (options.closes) done.closed = close_openings(mesh, options);
    turned.resize(mesh.triangles.size(), 0);
    if (mesh.triangles.size() > done.triangles) {  // adds the lids to the pieces
        std::vector<std::uint8_t> none(mesh.triangles.size(), 0);
        pieces = make_agree(mesh, none);
    }
    std::optional<RayScene> scene;
    if (options.face_gas) scene.emplace(mesh);
    std::vector<Seen> seen;
    seen.reserve(pieces.size());
    for (const Piece& piece : pieces) seen.push_back(scene ? seen_from_above(mesh, *scene, piece) : Seen{});
    // Visible pieces come first: their orientation tells gas from material for those hidden below.
    for (const bool hidden : {false, true})
        for (std::size_t i = 0; i < pieces.size(); ++i) {
            const Piece& piece = pieces[i];
            const auto [front, back] = seen[i];
            if (hidden != (front + back == 0.0)) continue;
            if (std::min(front, back) > 0.25 * (front + back)) {
                const Vec3 c = triangle_centroid(mesh, piece.triangles.front());
                throw GeometryError(
                    "from above, the piece of the surface around ({:.6g}, {:.6g}, {:.6g}) shows its front in "
                    "some places and its back in others: it does not tell which side is the material's; close "
                    "the mesh, or cut away what is open to behind",
                    c.x(), c.y(), c.z());
            }
            if (hidden ? !better_reversed(mesh, scene ? &*scene : nullptr, piece, turned) : back <= front)
                continue;
            for (const std::uint32_t t : piece.triangles) {
                turn_over(mesh, t);
                turned[t] ^= 1;
            }
        }
    turned.resize(done.triangles);
    done.turned = static_cast<std::size_t>(std::count(turned.begin(), turned.end(), 1));
}

}  // namespace sidewall::surface
