#include "surface/marching_cubes.hpp"

#include <openvdb/Grid.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <vector>

#include "surface/error.hpp"

namespace sidewall::surface {
namespace {

using Leaf = FloatGrid::TreeType::LeafNodeType;
constexpr std::uint32_t kNone = 0xffffffffu;

struct CoordHash {
    std::size_t operator()(const openvdb::Coord& c) const {
        return static_cast<std::size_t>(c.x() / 8) * 73856093u ^
               static_cast<std::size_t>(c.y() / 8) * 19349663u ^
               static_cast<std::size_t>(c.z() / 8) * 83492791u;
    }
};

// A leaf's own edges (from each node towards +x, +y, +z) that the surface crosses, as bit sets. A vertex's
// number is the leaf's first number plus the rank of its bit, so no per-edge table is needed.
struct LeafEdges {
    std::array<std::array<std::uint64_t, 8>, 3> crossed{};
    std::array<std::array<std::uint32_t, 8>, 3> rank{};  // set bits before each word
    std::uint32_t first_vertex = 0, first_triangle = 0, vertices = 0, triangles = 0;

    std::uint32_t vertex(int axis, int node) const {
        const auto a = static_cast<std::size_t>(axis), w = static_cast<std::size_t>(node >> 6);
        const std::uint64_t before = crossed[a][w] & ((std::uint64_t{1} << (node & 63)) - 1);
        return first_vertex + rank[a][w] + static_cast<std::uint32_t>(std::popcount(before));
    }
    std::uint32_t count() {
        std::uint32_t n = 0;
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t w = 0; w < 8; ++w) {
                rank[a][w] = n;
                n += static_cast<std::uint32_t>(std::popcount(crossed[a][w]));
            }
        return n;
    }
};

// The leaf's 8^3 nodes and one more layer on the high sides. Nodes outside the band are marked by NaN.
struct Cells {
    static constexpr int kSide = 9;
    std::array<float, kSide * kSide * kSide> value;
    // Of each row of nodes along z, which lie inside and which outside, as bits.
    std::array<std::uint16_t, kSide * kSide> inside, outside;
    static constexpr int at(int x, int y, int z) { return (x * kSide + y) * kSide + z; }

    void load(const FloatGrid::ConstUnsafeAccessor& grid, const Leaf& leaf, const LateralGrid& box) {
        const openvdb::Coord o = leaf.origin();
        std::array<const Leaf*, 8> part;
        for (int p = 0; p < 8; ++p)
            part[static_cast<std::size_t>(p)] =
                p == 0 ? &leaf : grid.probeConstLeaf(o.offsetBy(8 * (p & 1), 8 * (p >> 1 & 1), 8 * (p >> 2)));
        for (int x = 0; x < kSide; ++x)
            for (int y = 0; y < kSide; ++y) {
                const bool inside_box = o.x() + x >= 0 && o.y() + y >= 0 && o.x() + x <= box.cells[0] &&
                                        o.y() + y <= box.cells[1];
                const auto column = static_cast<std::size_t>((x >> 3) | (y >> 3) << 1);
                load_row(inside_box ? part[column] : nullptr, inside_box ? part[column | 4] : nullptr,
                         static_cast<openvdb::Index>((x & 7) << 3 | (y & 7)),
                         static_cast<std::size_t>(x * kSide + y));
            }
    }
    float operator()(int x, int y, int z) const { return value[static_cast<std::size_t>(at(x, y, z))]; }

    // Whether the surface may cross an edge of the cells between (x, y) and (x + 1, y + 1).
    bool row_is_cut(int x, int y) const {
        const auto n = static_cast<std::size_t>(x * kSide + y);
        const int in = inside[n] | inside[n + 1] | inside[n + kSide] | inside[n + kSide + 1];
        const int out = outside[n] | outside[n + 1] | outside[n + kSide] | outside[n + kSide + 1];
        return in != 0 && out != 0;
    }

  private:
    void load_row(const Leaf* low, const Leaf* high, openvdb::Index leaf_row, std::size_t row) {
        float* v = &value[row * kSide];
        const unsigned known = (low ? low->getValueMask().getWord<openvdb::Byte>(leaf_row) : 0u) |
                               (high && high->isValueOn(8 * leaf_row) ? 1u << 8 : 0u);
        if (low) std::copy_n(low->buffer().data() + 8 * leaf_row, 8, v);
        if (high) v[8] = high->buffer().data()[8 * leaf_row];
        unsigned negative = 0;
        for (unsigned z = 0; z < kSide; ++z) {
            if (!(known >> z & 1)) v[z] = std::numeric_limits<float>::quiet_NaN();
            negative |= static_cast<unsigned>(v[z] < 0.0f) << z;
        }
        inside[row] = static_cast<std::uint16_t>(negative);
        outside[row] = static_cast<std::uint16_t>(known & ~negative);
    }
};

bool crossed(float a, float b) {
    return !std::isnan(a) && !std::isnan(b) && (a < 0.0f) != (b < 0.0f);
}

// Sign pattern of the cell at (x, y, z); -1 if a node is unknown; `cut` tells whether both signs occur.
int cell_pattern(const Cells& cells, int x, int y, int z, bool& cut) {
    int pattern = 0, known = 0;
    for (int c = 0; c < 8; ++c) {
        const float v = cells(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
        known += !std::isnan(v);
        pattern |= (v < 0.0f) << c;
    }
    cut = pattern != 0 && std::popcount(static_cast<unsigned>(pattern)) != known;
    return known == 8 ? pattern : -1;
}

using Owners = std::array<const LeafEdges*, 8>;  // of the leaves at and beyond a leaf's high sides

bool in_box(const openvdb::Coord& origin, int x, int y, const LateralGrid& box) {
    return origin.x() + x < box.cells[0] && origin.y() + y < box.cells[1];
}

// Marks the edges that the surface crosses and counts the triangles of the leaf's own cells.
// \returns whether all corners of the cells that the surface passes through are known.
bool mark_crossings(const Cells& cells, const openvdb::Coord& origin, const LateralGrid& box,
                    LeafEdges& own) {
    const auto& table = marching_cubes_table();
    bool complete = true;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            if (!cells.row_is_cut(x, y)) continue;
            for (int z = 0; z < 8; ++z) {
                const float v = cells(x, y, z);
                if (std::isnan(v)) continue;
                const int node = x << 6 | y << 3 | z;
                const float next[3] = {cells(x + 1, y, z), cells(x, y + 1, z), cells(x, y, z + 1)};
                for (std::size_t a = 0; a < 3; ++a)
                    if (crossed(v, next[a]))
                        own.crossed[a][static_cast<std::size_t>(node >> 6)] |= std::uint64_t{1}
                                                                               << (node & 63);
                if (!in_box(origin, x, y, box)) continue;
                bool cut = false;
                const int pattern = cell_pattern(cells, x, y, z, cut);
                if (!cut) continue;
                if (pattern < 0)
                    complete = false;
                else
                    own.triangles +=
                        static_cast<std::uint32_t>(table[static_cast<std::size_t>(pattern)].size() / 3);
            }
        }
    return complete;
}

// Writes the vertices on the leaf's own edges, in the order of LeafEdges.
void place_vertices(const LeafEdges& own, const Cells& cells, const openvdb::Coord& origin,
                    const LateralGrid& box, std::vector<Vec3>& vertices) {
    const auto coordinate = [&](int axis, int i) {
        if (axis == 2) return i * box.spacing;
        const auto a = static_cast<std::size_t>(axis);
        return i == box.cells[a] ? box.max[a] : box.min[a] + i * box.spacing;
    };
    std::uint32_t vertex = own.first_vertex;
    for (int axis = 0; axis < 3; ++axis)
        for (std::size_t w = 0; w < 8; ++w)
            for (std::uint64_t bits = own.crossed[static_cast<std::size_t>(axis)][w]; bits != 0;
                 bits &= bits - 1) {
                const int node = static_cast<int>(w) << 6 | std::countr_zero(bits);
                const int local[3] = {node >> 6, node >> 3 & 7, node & 7};
                const auto a = static_cast<double>(cells(local[0], local[1], local[2]));
                const auto b = static_cast<double>(
                    cells(local[0] + (axis == 0), local[1] + (axis == 1), local[2] + (axis == 2)));
                const double t = std::clamp(a / (a - b), kNodeClearance, 1.0 - kNodeClearance);
                Vec3& p = vertices[vertex++];
                for (int k = 0; k < 3; ++k) p[k] = coordinate(k, origin[k] + local[k]);
                p[axis] += t * box.spacing;
            }
}

// Writes the triangles of the leaf's own cells; some of their edges belong to leaves on the high sides.
void connect_vertices(const Owners& owners, const Cells& cells, const openvdb::Coord& origin,
                      const LateralGrid& box, std::vector<Triangle>& triangles) {
    const auto& table = marching_cubes_table();
    std::uint32_t triangle = owners[0]->first_triangle;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            if (!in_box(origin, x, y, box) || !cells.row_is_cut(x, y)) continue;
            for (int z = 0; z < 8; ++z) {
                bool cut = false;
                const int pattern = cell_pattern(cells, x, y, z, cut);
                if (!cut) continue;
                const auto vertex_on = [&](int edge) {
                    const int corner = edge_corner(edge);
                    const int i = x + (corner & 1), j = y + (corner >> 1 & 1), k = z + (corner >> 2);
                    const LeafEdges* leaf =
                        owners[static_cast<std::size_t>((i >> 3) | (j >> 3) << 1 | (k >> 3) << 2)];
                    return leaf ? leaf->vertex(edge / 4, (i & 7) << 6 | (j & 7) << 3 | (k & 7)) : kNone;
                };
                const auto& list = table[static_cast<std::size_t>(pattern)];
                for (std::size_t e = 0; e < list.size(); e += 3)
                    triangles[triangle++] = {vertex_on(list[e]), vertex_on(list[e + 1]),
                                             vertex_on(list[e + 2])};
            }
        }
}

}  // namespace

TriangleMesh marching_cubes(const FloatGrid& phi, const LateralGrid& box) {
    std::vector<const Leaf*> leaves;
    phi.tree().getNodes(leaves);
    std::vector<LeafEdges> edges(leaves.size());
    const auto each_leaf = [&](auto&& wanted, auto&& op) {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 8), [&](const auto& range) {
            const auto accessor = phi.getConstUnsafeAccessor();
            Cells cells;
            for (std::size_t n = range.begin(); n != range.end(); ++n) {
                if (!wanted(n)) continue;
                cells.load(accessor, *leaves[n], box);
                op(n, cells);
            }
        });
    };

    std::atomic<bool> complete{true};
    each_leaf([](std::size_t) { return true; },
              [&](std::size_t n, const Cells& cells) {
                  if (!mark_crossings(cells, leaves[n]->origin(), box, edges[n])) complete = false;
              });
    if (!complete)
        throw NumericsError(
            "the narrow band does not enclose the surface; re-distance the level set before extracting");

    std::uint32_t vertex_count = 0, triangle_count = 0;
    std::unordered_map<openvdb::Coord, std::uint32_t, CoordHash> index;
    index.reserve(leaves.size() * 2);
    for (std::size_t n = 0; n < leaves.size(); ++n) {
        edges[n].first_vertex = vertex_count;
        edges[n].first_triangle = triangle_count;
        edges[n].vertices = edges[n].count();
        vertex_count += edges[n].vertices;
        triangle_count += edges[n].triangles;
        index.emplace(leaves[n]->origin(), static_cast<std::uint32_t>(n));
    }

    TriangleMesh mesh;
    mesh.vertices.resize(vertex_count);
    mesh.triangles.resize(triangle_count);
    const auto cut = [&](std::size_t n) { return edges[n].vertices > 0 || edges[n].triangles > 0; };
    each_leaf(cut, [&](std::size_t n, const Cells& cells) {
        const openvdb::Coord origin = leaves[n]->origin();
        Owners owners{&edges[n]};
        for (int p = 1; p < 8; ++p) {
            const auto it = index.find(origin.offsetBy(8 * (p & 1), 8 * (p >> 1 & 1), 8 * (p >> 2)));
            owners[static_cast<std::size_t>(p)] = it == index.end() ? nullptr : &edges[it->second];
        }
        place_vertices(edges[n], cells, origin, box, mesh.vertices);
        connect_vertices(owners, cells, origin, box, mesh.triangles);
    });
    return mesh;
}

}  // namespace sidewall::surface
