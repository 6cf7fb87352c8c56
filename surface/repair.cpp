#include "surface/repair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/functional/hash.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <unordered_map>
#include <utility>
#include <vector>

#include "surface/error.hpp"
#include "surface/orientation.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

constexpr double kReach = 1e-5;     // share of the mesh's diagonal: rounding of coordinates with six digits
constexpr double kEdgeReach = 0.1;  // share of the median edge: two sides of a thin band are not merged

// Number of edges for whose number of triangles \p counts is true.
template <class Counts>
std::size_t edges_where(const TriangleMesh& mesh, Counts&& counts) {
    const EdgeTable table = edge_table(mesh);
    std::size_t count = 0;
    for (std::size_t e = 0; e < table.edges.size(); ++e) count += counts(table.corners[e].size());
    return count;
}

std::size_t single_edges(const TriangleMesh& mesh) {
    return edges_where(mesh, [](std::size_t triangles) { return triangles == 1; });
}

// Number of edges with an odd number of triangles; a closed body has none.
std::size_t odd_edges(const TriangleMesh& mesh) {
    return edges_where(mesh, [](std::size_t triangles) { return triangles % 2; });
}

// Per vertex, the lowest index of a vertex at the same position.
std::vector<std::uint32_t> first_of_position(const TriangleMesh& mesh) {
    using Place = std::array<double, 3>;
    std::unordered_map<Place, std::uint32_t, boost::hash<Place>> seen;
    std::vector<std::uint32_t> first;
    for (const Vec3& p : mesh.vertices) {
        const auto v = static_cast<std::uint32_t>(first.size());
        // Adding zero turns -0 into 0.
        first.push_back(seen.try_emplace({p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}, v).first->second);
    }
    return first;
}

// The mesh with every vertex v replaced by first[v], and without vertices that are then unused.
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
    for (Attribute& attribute : result.vertex_attributes) take_elements(attribute, kept);
    for (const auto& [a, b, c] : mesh.triangles)
        result.triangles.push_back({number[first[a]], number[first[b]], number[first[c]]});
    return result;
}

std::size_t drop_unused(TriangleMesh& mesh) {
    const std::size_t before = mesh.vertices.size();
    std::vector<std::uint32_t> itself(before);
    std::iota(itself.begin(), itself.end(), 0u);
    mesh = merged(mesh, itself);
    return before - mesh.vertices.size();
}

// Per vertex, the nearest unmerged vertex of lower index within \p reach, or itself. Only vertices of
// boundary edges are merged, and no two corners of a triangle into one.
std::vector<std::uint32_t> first_nearby(const TriangleMesh& mesh, double reach) {
    const EdgeTable table = edge_table(mesh);
    std::vector<std::uint8_t> loose(mesh.vertices.size(), 0);
    for (std::size_t e = 0; e < table.edges.size(); ++e)
        if (table.corners[e].size() == 1)
            for (const std::uint32_t v : table.edges[e]) loose[v] = 1;
    const Rows corners = vertex_corners(mesh);
    std::vector<std::uint32_t> first(mesh.vertices.size());
    std::iota(first.begin(), first.end(), 0u);
    const auto share_triangle = [&](std::uint32_t v, std::uint32_t with) {
        return std::ranges::any_of(corners[v], [&](std::uint32_t corner) {
            return std::ranges::any_of(mesh.triangles[corner / 3],
                                       [&](std::uint32_t other) { return first[other] == with; });
        });
    };
    using Cell = std::array<std::int64_t, 3>;
    const Vec3 origin = bounding_box(mesh).min;
    const auto cell_of = [&](const Vec3& p) {
        const Vec3 at = ((p - origin) / (4.0 * reach)).array().floor();
        return Cell{static_cast<std::int64_t>(at.x()), static_cast<std::int64_t>(at.y()),
                    static_cast<std::int64_t>(at.z())};
    };
    std::multimap<Cell, std::uint32_t> kept;
    for (std::uint32_t v = 0; v < first.size(); ++v) {
        if (!loose[v]) continue;
        const Vec3& p = mesh.vertices[v];
        const Cell low = cell_of(p.array() - reach), high = cell_of(p.array() + reach);
        double nearest = reach;
        for (Cell at = low; at[0] <= high[0]; ++at[0])
            for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
                for (at[2] = low[2]; at[2] <= high[2]; ++at[2])
                    for (auto [k, end] = kept.equal_range(at); k != end; ++k) {
                        const double distance = (mesh.vertices[k->second] - p).norm();
                        if (distance > nearest || share_triangle(v, k->second)) continue;
                        nearest = distance;
                        first[v] = k->second;
                    }
        if (first[v] == v) kept.emplace(cell_of(p), v);
    }
    return first;
}

// Distance up to which vertices are merged as split by rounding; 0 where edges are too short to tell.
double reach_of(const TriangleMesh& mesh) {
    std::vector<double> edges;
    edges.reserve(3 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            edges.push_back((mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
    const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
    std::nth_element(edges.begin(), middle, edges.end());
    const double diagonal = bounding_box(mesh).size().norm(),
                 reach = std::min(kReach * diagonal, kEdgeReach * *middle);
    return reach > std::numeric_limits<double>::epsilon() * diagonal ? reach : 0.0;
}

void weld(TriangleMesh& mesh, Repairs& done) {
    std::size_t loose = single_edges(mesh);
    const auto weld_by = [&](const std::vector<std::uint32_t>& first) -> std::size_t {
        TriangleMesh whole = merged(mesh, first);
        const std::size_t welded = mesh.vertices.size() - whole.vertices.size();
        if (welded == 0) return 0;
        const std::size_t left = single_edges(whole);
        if (left >= loose) return 0;
        loose = left;
        mesh = std::move(whole);
        return welded;
    };
    if (loose > 0) done.welded = weld_by(first_of_position(mesh));
    if (loose > 0) done.reach = reach_of(mesh);
    if (done.reach > 0.0) done.nearby = weld_by(first_nearby(mesh, done.reach));
}

// Keeps the triangles whose flag is 1; returns how many were dropped.
std::size_t keep_triangles(TriangleMesh& mesh, const std::vector<std::uint8_t>& kept) {
    const auto dropped = static_cast<std::size_t>(std::ranges::count(kept, 0));
    if (dropped == 0) return 0;
    std::vector<std::uint32_t> order;
    std::vector<Triangle> triangles;
    order.reserve(kept.size() - dropped);
    triangles.reserve(kept.size() - dropped);
    for (std::uint32_t t = 0; t < kept.size(); ++t) {
        if (!kept[t]) continue;
        order.push_back(t);
        triangles.push_back(mesh.triangles[t]);
    }
    mesh.triangles = std::move(triangles);
    for (Attribute& attribute : mesh.triangle_attributes) take_elements(attribute, order);
    return dropped;
}

std::size_t drop_collapsed(TriangleMesh& mesh) {
    std::vector<std::uint8_t> kept;
    kept.reserve(mesh.triangles.size());
    for (const auto& [a, b, c] : mesh.triangles) kept.push_back(a != b && b != c && c != a ? 1 : 0);
    if (std::ranges::count(kept, 1) == 0)
        throw GeometryError("all triangles have two corners in one place: export the surface again");
    return keep_triangles(mesh, kept);
}

// Drops repeats of a triangle, or both of an opposed pair where that leaves fewer odd edges.
std::size_t drop_repeated(TriangleMesh& mesh) {
    const auto key = [&](std::uint32_t t) {
        Triangle vertices = mesh.triangles[t];
        std::sort(vertices.begin(), vertices.end());
        return vertices;
    };
    // Whether indices ascend from the lowest on: triangles on the same vertices are opposed if this differs.
    const auto rises = [&](std::uint32_t t) {
        Triangle cycle = mesh.triangles[t];
        std::rotate(cycle.begin(), std::min_element(cycle.begin(), cycle.end()), cycle.end());
        return cycle[1] < cycle[2];
    };
    std::vector<std::uint32_t> order(mesh.triangles.size());
    std::iota(order.begin(), order.end(), 0u);
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    std::vector<std::uint8_t> first(order.size(), 1), cancelled(order.size(), 1);
    for (std::size_t i = 1; i < order.size(); ++i) {
        if (key(order[i]) != key(order[i - 1])) continue;
        first[order[i]] = cancelled[order[i]] = 0;
        if (rises(order[i]) != rises(order[i - 1])) cancelled[order[i - 1]] = 0;
    }
    if (std::ranges::find(first, 0) == first.end()) return 0;
    TriangleMesh apart = mesh;
    const std::size_t dropped = keep_triangles(mesh, first), more = keep_triangles(apart, cancelled);
    if (more == dropped || apart.triangles.empty() || odd_edges(apart) >= odd_edges(mesh)) return dropped;
    mesh = std::move(apart);
    return more;
}

}  // namespace

Repairs repair(TriangleMesh& mesh, const RepairOptions& options) {
    Repairs done;
    done.unused = drop_unused(mesh);
    weld(mesh, done);
    done.collapsed = drop_collapsed(mesh);
    done.repeated = drop_repeated(mesh);
    orient(mesh, options, done);
    return done;
}

std::string repair_summary(const Repairs& repairs) {
    std::vector<std::string> words;
    for (const auto& [count, what] :
         {std::pair(repairs.unused, "vertices that no triangle uses were dropped"),
          {repairs.welded, "vertices of the same position as another were merged with it"},
          {repairs.collapsed, "triangles with two corners in one place were dropped"},
          {repairs.repeated, "triangles that are listed again were dropped"},
          {repairs.closed, "openings were closed"}})
        if (count > 0) words.push_back(fmt::format("{} {}", count, what));
    if (repairs.nearby > 0)
        words.push_back(fmt::format("{} vertices less than {:.2g} from another were merged with it",
                                    repairs.nearby, repairs.reach));
    if (repairs.turned > 0 && repairs.turned == repairs.triangles)
        words.push_back(
            fmt::format("the surface was inside out: all {} triangles were turned over", repairs.turned));
    else if (repairs.turned > 0)
        words.push_back(fmt::format(
            "{} of {} triangles were turned over, so that all agree and show their front to the gas",
            repairs.turned, repairs.triangles));
    return fmt::format("{}", fmt::join(words, "; "));
}

}  // namespace sidewall::surface
