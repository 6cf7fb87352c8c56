#include "surface/extraction/marching_cubes.hpp"

#include <algorithm>

#include "surface/extraction/crossing_planes.hpp"
#include "surface/extraction/cut_leaves.hpp"
#include "surface/extraction/sharp_edges.hpp"
#include "surface/parallel.hpp"

namespace sidewall::surface {
namespace {

// Writes the vertices on the leaf's own edges, in the order of LeafEdges.
void place_vertices(const LeafEdges& own, const Parts<FloatLeaf>& part, const LateralGrid& box,
                    std::vector<Vec3>& vertices) {
    const openvdb::Coord origin = part[0]->origin();
    Parts<float> values{};
    for (std::size_t p = 0; p < 8; ++p)
        if (part[p]) values[p] = part[p]->buffer().data();
    std::uint32_t vertex = own.first_vertex;
    for (int axis = 0; axis < 3; ++axis) {
        const int shift = 6 - 3 * axis;  // of the axis's index in a node's number
        for (std::size_t w = 0; w < 8; ++w)
            for (std::uint64_t bits = own.crossed[static_cast<std::size_t>(axis)][w]; bits != 0;
                 bits &= bits - 1) {
                const int node = static_cast<int>(w) << 6 | std::countr_zero(bits);
                const bool last = (node >> shift & 7) == 7;
                const int next = last ? node - (7 << shift) : node + (1 << shift);
                const auto a = static_cast<double>(values[0][node]);
                const auto b = static_cast<double>(values[last ? std::size_t{1} << axis : 0][next]);
                const double t = std::clamp(chord(a, b, box.on_node), kNodeClearance, 1.0 - kNodeClearance);
                Vec3& p = vertices[vertex++];
                for (int k = 0; k < 3; ++k)
                    p[k] = node_coordinate(box, k, origin[k] + (node >> (6 - 3 * k) & 7));
                p[axis] += t * box.spacing;
            }
    }
}

// Writes the triangles of the leaf's own cells; some of their edges belong to leaves on the high sides.
void connect_vertices(const CutLeaves& leaves, std::size_t n, std::vector<Triangle>& triangles) {
    const auto& table = marching_cubes_table();
    const Parts<LeafEdges> part = leaves.edge_parts(n);
    std::uint32_t triangle = part[0]->first_triangle;
    leaves.each_cell(n, leaves.signs(n), [&](int x, int y, int z, std::size_t pattern) {
        const auto vertex_on = [&](int edge) {
            const int corner = edge_corner(edge);
            const int i = x + (corner & 1), j = y + (corner >> 1 & 1), k = z + (corner >> 2);
            const LeafEdges* leaf = part[static_cast<std::size_t>((i >> 3) | (j >> 3) << 1 | (k >> 3) << 2)];
            return leaf ? leaf->vertex(edge / 4, (i & 7) << 6 | (j & 7) << 3 | (k & 7)) : kNoVertex;
        };
        const auto& list = table[pattern];
        for (std::size_t e = 0; e < list.size(); e += 3)
            triangles[triangle++] = {vertex_on(list[e]), vertex_on(list[e + 1]), vertex_on(list[e + 2])};
    });
}

}  // namespace

SharpVertices marching_cubes(const std::vector<const FloatLeaf*>& leaves, const LateralGrid& box,
                             TriangleMesh& mesh, SharpEdges edges) {
    const CutLeaves cut(leaves, box, mesh);
    mesh.vertices.resize(cut.vertices());
    mesh.triangles.resize(cut.triangles());
    parallel_each(cut.size(), 4, [&](std::size_t n) {
        const LeafEdges& own = cut.edges(n);
        if (own.vertices > 0) place_vertices(own, cut.leaf_parts(n), box, mesh.vertices);
        if (own.triangles > 0) connect_vertices(cut, n, mesh.triangles);
    });
    if (edges == SharpEdges::none) return {cut.vertices(), {}};
    return add_sharp_edges(cut, box, edges, mesh);
}

}  // namespace sidewall::surface
