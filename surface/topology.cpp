#include "surface/topology.hpp"

#include <tbb/parallel_sort.h>

#include <map>
#include <set>

namespace sidewall::surface {
namespace {

struct KeyedCorner {
    std::uint64_t edge;
    std::uint32_t corner;
    bool operator<(const KeyedCorner& o) const { return edge != o.edge ? edge < o.edge : corner < o.corner; }
};

bool repeats_vertex(const Triangle& t) {
    return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

std::size_t count_duplicates(const TriangleMesh& mesh) {
    std::vector<Triangle> sorted = mesh.triangles;
    for (Triangle& t : sorted) std::sort(t.begin(), t.end());
    tbb::parallel_sort(sorted);
    std::size_t count = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) count += sorted[i] == sorted[i - 1];
    return count;
}

std::size_t count_components(const TriangleMesh& mesh, const Rows& corners) {
    DisjointSets sets(mesh.vertices.size());
    for (const auto& [a, b, c] : mesh.triangles) {
        sets.join(a, b);
        sets.join(b, c);
    }
    std::size_t count = 0;
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
        count += !corners[v].empty() && sets.root(v) == v;
    return count;
}

/// Whether the triangles around a vertex form more than one fan: whether the graph that their opposite edges
/// form on the neighbouring vertices is disconnected.
bool several_fans(const TriangleMesh& mesh, std::span<const std::uint32_t> corners,
                  std::vector<std::uint32_t>& neighbours) {
    neighbours.clear();
    const auto opposite = [&](std::uint32_t corner) {
        const Triangle& t = mesh.triangles[corner / 3];
        return std::array{t[(corner + 1) % 3], t[(corner + 2) % 3]};
    };
    const auto proper = [&](std::uint32_t corner) { return !repeats_vertex(mesh.triangles[corner / 3]); };
    for (const std::uint32_t corner : corners)
        if (proper(corner))
            for (const std::uint32_t v : opposite(corner)) neighbours.push_back(v);
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    if (neighbours.empty()) return false;
    const auto local = [&](std::uint32_t v) {
        const auto at = std::lower_bound(neighbours.begin(), neighbours.end(), v);
        return static_cast<std::uint32_t>(at - neighbours.begin());
    };
    DisjointSets sets(neighbours.size());
    for (const std::uint32_t corner : corners)
        if (proper(corner)) sets.join(local(opposite(corner)[0]), local(opposite(corner)[1]));
    for (std::uint32_t i = 1; i < neighbours.size(); ++i)
        if (sets.root(i) != 0) return true;
    return false;
}

}  // namespace

std::vector<Chain> join_links(const std::vector<Link>& links) {
    const auto n = static_cast<std::uint32_t>(links.size());
    std::multimap<std::uint64_t, std::uint32_t> unused;  // by the joint where they start, then by index
    std::set<std::uint64_t> ends;
    for (std::uint32_t i = 0; i < n; ++i) {
        unused.emplace(links[i].from, i);
        ends.insert(links[i].to);
    }
    std::vector<std::uint8_t> used(n, 0);
    std::vector<Chain> chains;
    const auto follow = [&](std::uint32_t start) {
        Chain chain;
        std::uint64_t joint = links[start].from;
        for (auto next = unused.lower_bound(joint); next != unused.end() && next->first == joint;
             next = unused.lower_bound(joint)) {
            const std::uint32_t i = next->second;
            unused.erase(next);
            used[i] = 1;
            chain.links.push_back(i);
            joint = links[i].to;
        }
        chain.closed = joint == links[start].from;
        chains.push_back(std::move(chain));
    };
    for (std::uint32_t i = 0; i < n; ++i)
        if (!used[i] && !ends.contains(links[i].from)) follow(i);
    for (std::uint32_t i = 0; i < n; ++i)
        if (!used[i]) follow(i);
    return chains;
}

EdgeTable edge_table(const TriangleMesh& mesh) {
    std::vector<KeyedCorner> keyed;
    keyed.reserve(3 * mesh.triangles.size());
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
            if (a == b) continue;
            keyed.push_back({std::uint64_t{std::min(a, b)} << 32 | std::max(a, b), 3 * t + k});
        }
    tbb::parallel_sort(keyed);
    EdgeTable table;
    table.corners.items.reserve(keyed.size());
    for (std::size_t i = 0; i < keyed.size(); ++i) {
        if (i == 0 || keyed[i].edge != keyed[i - 1].edge) {
            if (i > 0) table.corners.offsets.push_back(static_cast<std::uint32_t>(i));
            table.edges.push_back(
                {static_cast<std::uint32_t>(keyed[i].edge >> 32), static_cast<std::uint32_t>(keyed[i].edge)});
        }
        table.corners.items.push_back(keyed[i].corner);
    }
    if (!keyed.empty()) table.corners.offsets.push_back(static_cast<std::uint32_t>(keyed.size()));
    return table;
}

Rows vertex_corners(const TriangleMesh& mesh) {
    Rows rows;
    rows.offsets.assign(mesh.vertices.size() + 1, 0);
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) ++rows.offsets[v + 1];
    std::partial_sum(rows.offsets.begin(), rows.offsets.end(), rows.offsets.begin());
    rows.items.resize(3 * mesh.triangles.size());
    std::vector<std::uint32_t> next(rows.offsets.begin(), rows.offsets.end() - 1);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::uint32_t k = 0; k < 3; ++k) rows.items[next[mesh.triangles[t][k]]++] = 3 * t + k;
    return rows;
}

Topology analyse_topology(const TriangleMesh& mesh) {
    Topology topology;
    const Rows corners = vertex_corners(mesh);
    const EdgeTable table = edge_table(mesh);
    topology.triangles = mesh.triangles.size();
    topology.edges = table.edges.size();
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        ++(corners[v].empty() ? topology.isolated_vertices : topology.vertices);
    topology.components = count_components(mesh, corners);
    topology.duplicate_triangles = count_duplicates(mesh);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        topology.degenerate_triangles +=
            repeats_vertex(mesh.triangles[t]) || area_vector(mesh, t).isZero(0.0);

    std::vector<Link> boundary;
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto uses = table.corners[e];
        const auto start = [&](std::uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
        if (uses.size() == 1) {
            const std::uint32_t from = start(uses[0]);
            const std::uint32_t to = from == table.edges[e][0] ? table.edges[e][1] : table.edges[e][0];
            boundary.push_back({from, to});
            topology.boundary.push_back({from, to});
        } else if (uses.size() == 2) {
            topology.inconsistent_edges += start(uses[0]) == start(uses[1]);
        } else {
            ++topology.nonmanifold_edges;
        }
    }
    topology.boundary_edges = boundary.size();
    for (const Chain& chain : join_links(boundary)) {
        for (const std::uint32_t link : chain.links)
            topology.boundary_loops.items.push_back(static_cast<std::uint32_t>(boundary[link].from));
        if (!chain.closed)
            topology.boundary_loops.items.push_back(
                static_cast<std::uint32_t>(boundary[chain.links.back()].to));
        topology.boundary_loops.offsets.push_back(
            static_cast<std::uint32_t>(topology.boundary_loops.items.size()));
    }

    std::vector<std::uint32_t> scratch;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        topology.nonmanifold_vertices += several_fans(mesh, corners[v], scratch);
    return topology;
}

bool boundary_on_rectangle(const TriangleMesh& mesh, const Topology& topology) {
    if (topology.closed()) return false;
    const Box3 box = bounding_box(mesh);
    const auto on_a_side = [&](std::uint32_t a, std::uint32_t b) {
        for (int axis = 0; axis < 2; ++axis)
            for (const double side : {box.min[axis], box.max[axis]})
                if (mesh.vertices[a][axis] == side && mesh.vertices[b][axis] == side) return true;
        return false;
    };
    for (const auto& [a, b] : topology.boundary)
        if (!on_a_side(a, b)) return false;
    return true;
}

}  // namespace sidewall::surface
