#include "surface/extraction/marching_cubes.hpp"

#include <openvdb/Grid.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <memory>
#include <span>
#include <vector>

#include "surface/error.hpp"
#include "surface/extraction/leaf_table.hpp"
#include "surface/parallel.hpp"

namespace sidewall::surface {
namespace {

using Leaf = FloatLeaf;
constexpr std::uint32_t kNoVertex = 0xffffffffu;

// A leaf's own edges (from each node towards +x, +y, +z) that the surface crosses, as bit sets. A vertex's
// number is the leaf's first number plus the rank of its bit, so no per-edge table is needed.
struct LeafEdges {
    std::array<std::array<std::uint64_t, 8>, 3> crossed;
    std::array<std::array<std::uint32_t, 8>, 3> rank;  // set bits before each word
    std::uint32_t first_vertex, first_triangle, vertices, triangles;

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

// The nodes of a leaf that are known, as those of the band are, and that lie inside: bit z of byte 8 x + y.
struct LeafSigns {
    std::array<std::uint8_t, 64> known, inside;
    bool any_inside, any_outside;

    LeafSigns() = default;
    explicit LeafSigns(const Leaf& leaf) {
        unsigned in = 0, out = 0;
        const float* v = leaf.buffer().data();
        for (std::size_t row = 0; row < 64; ++row, v += 8) {
            unsigned negative = 0;
            for (unsigned z = 0; z < 8; ++z) negative |= static_cast<unsigned>(v[z] < 0.0f) << z;
            const unsigned all = leaf.getValueMask().getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
            known[row] = static_cast<std::uint8_t>(all);
            inside[row] = static_cast<std::uint8_t>(all & negative);
            in |= all & negative;
            out |= all & ~negative;
        }
        any_inside = in != 0, any_outside = out != 0;
    }
};

// Parts of a leaf and of those on its high sides: at +x for bit 0 of the index, +y for bit 1, +z for bit 2.
// Null where there is no leaf.
template <class T>
using Parts = std::array<const T*, 8>;

// The signs at a leaf's 8^3 nodes and one more layer on the high sides: bit z of a row of nine nodes.
struct Signs {
    static constexpr int kSide = 9;
    std::array<std::uint16_t, kSide * kSide> known, inside;

    void load(const Parts<LeafSigns>& part, const openvdb::Coord& origin, const LateralGrid& box) {
        for (int x = 0; x < kSide; ++x)
            for (int y = 0; y < kSide; ++y) {
                const bool inside_box = origin.x() + x >= 0 && origin.y() + y >= 0 &&
                                        origin.x() + x <= box.cells[0] && origin.y() + y <= box.cells[1];
                const auto column = static_cast<std::size_t>((x >> 3) | (y >> 3) << 1),
                           row = static_cast<std::size_t>((x & 7) << 3 | (y & 7));
                const LeafSigns* low = inside_box ? part[column] : nullptr;
                const LeafSigns* high = inside_box ? part[column | 4] : nullptr;
                const auto join = [&](auto rows) {
                    return static_cast<std::uint16_t>((low ? (low->*rows)[row] : 0u) |
                                                      (high ? ((high->*rows)[row] & 1u) << 8 : 0u));
                };
                known[at(x, y)] = join(&LeafSigns::known);
                inside[at(x, y)] = join(&LeafSigns::inside);
            }
    }

    // The edges from the row at (x, y) to the one at (i, j) that the surface crosses, by their z.
    unsigned crossed(int x, int y, int i, int j) const {
        return (inside[at(x, y)] ^ inside[at(i, j)]) & known[at(x, y)] & known[at(i, j)] & 0xffu;
    }
    // The edges along the row that the surface crosses.
    unsigned crossed(int x, int y) const {
        const unsigned in = inside[at(x, y)], all = known[at(x, y)];
        return (in ^ in >> 1) & all & all >> 1 & 0xffu;
    }
    // The cells between (x, y) and (x + 1, y + 1) that have corners inside and outside, by their z; \p whole:
    // whose corners are all known.
    unsigned cut_cells(int x, int y, unsigned& whole) const {
        unsigned in = 0, out = 0, all = 0xffffu;
        for (int c = 0; c < 4; ++c) {
            const std::size_t row = at(x + (c & 1), y + (c >> 1));
            const unsigned k = known[row], i = inside[row], o = k & ~i;
            in |= i | i >> 1, out |= o | o >> 1, all &= k & k >> 1;
        }
        whole = all;
        return in & out & 0xffu;
    }
    // Bit c: corner c of the cell at (x, y, z) lies inside; see marching_cubes_table.
    std::size_t pattern(int x, int y, int z) const {
        unsigned pattern = 0;
        for (int c = 0; c < 4; ++c) {
            const unsigned row = inside[at(x + (c & 1), y + (c >> 1))] >> z;
            pattern |= (row & 1u) << c | (row >> 1 & 1u) << (4 + c);
        }
        return pattern;
    }

  private:
    static std::size_t at(int x, int y) { return static_cast<std::size_t>(x * kSide + y); }
};

// What is made of a column of cells; those beyond the box are left out.
CellColumn column_at(int i, int j, const LateralGrid& box) {
    if (i < 0 || j < 0 || i >= box.cells[0] || j >= box.cells[1]) return CellColumn::left_out;
    return box.columns.empty() ? CellColumn::meshed
                               : box.columns[static_cast<std::size_t>(i * box.cells[1] + j)];
}

bool is_meshed(const openvdb::Coord& origin, int x, int y, const LateralGrid& box) {
    return column_at(origin.x() + x, origin.y() + y, box) == CellColumn::meshed;
}

// Whether the edges along an axis at a row of nodes have vertices: those of the cells beside them.
bool has_vertices(const openvdb::Coord& origin, int x, int y, int axis, const LateralGrid& box) {
    bool any = false;
    for (int i = origin.x() + x - (axis == 0 ? 0 : 1); i <= origin.x() + x; ++i)
        for (int j = origin.y() + y - (axis == 1 ? 0 : 1); j <= origin.y() + y; ++j) {
            const CellColumn column = column_at(i, j, box);
            if (column == CellColumn::bare) return false;
            any = any || column != CellColumn::left_out;
        }
    return any;
}

// The leaves with nodes of cells of which something is made.
std::vector<const Leaf*> leaves_of_columns(const std::vector<const Leaf*>& leaves, const LateralGrid& box) {
    std::vector<const Leaf*> kept;
    for (const Leaf* leaf : leaves) {
        const openvdb::Coord o = leaf->origin();
        bool any = false;
        for (int i = o.x() - 1; i < o.x() + 8 && !any; ++i)
            for (int j = o.y() - 1; j < o.y() + 8 && !any; ++j)
                any = column_at(i, j, box) >= CellColumn::vertices;
        if (any) kept.push_back(leaf);
    }
    return kept;
}

// Marks the edges that the surface crosses and counts the triangles of the leaf's own cells.
// \returns whether all corners of the cells that the surface passes through are known.
bool mark_crossings(const Signs& signs, const openvdb::Coord& origin, const LateralGrid& box,
                    LeafEdges& own) {
    const auto& table = marching_cubes_table();
    bool complete = true;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            const auto mark = [&](int axis, unsigned row) {
                if (row == 0 || (!box.columns.empty() && !has_vertices(origin, x, y, axis, box))) return;
                own.crossed[static_cast<std::size_t>(axis)][static_cast<std::size_t>(x)] |= std::uint64_t{row}
                                                                                            << (8 * y);
            };
            mark(0, signs.crossed(x, y, x + 1, y));
            mark(1, signs.crossed(x, y, x, y + 1));
            mark(2, signs.crossed(x, y));
            if (!is_meshed(origin, x, y, box)) continue;
            unsigned whole = 0;
            unsigned cut = signs.cut_cells(x, y, whole);
            complete = complete && (cut & ~whole) == 0;
            for (cut &= whole; cut != 0; cut &= cut - 1)
                own.triangles +=
                    static_cast<std::uint32_t>(table[signs.pattern(x, y, std::countr_zero(cut))].size() / 3);
        }
    return complete;
}

// Writes the vertices on the leaf's own edges, in the order of LeafEdges.
void place_vertices(const LeafEdges& own, const Parts<Leaf>& part, const LateralGrid& box,
                    std::vector<Vec3>& vertices) {
    const openvdb::Coord origin = part[0]->origin();
    const auto coordinate = [&](int axis, int i) {
        if (axis == 2) return i * box.spacing;
        const auto a = static_cast<std::size_t>(axis);
        return i == box.cells[a] ? box.max[a] : box.min[a] + i * box.spacing;
    };
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
                const double t = std::clamp(a / (a - b), kNodeClearance, 1.0 - kNodeClearance);
                Vec3& p = vertices[vertex++];
                for (int k = 0; k < 3; ++k) p[k] = coordinate(k, origin[k] + (node >> (6 - 3 * k) & 7));
                p[axis] += t * box.spacing;
            }
    }
}

// Writes the triangles of the leaf's own cells; some of their edges belong to leaves on the high sides.
void connect_vertices(const Parts<LeafEdges>& part, const Signs& signs, const openvdb::Coord& origin,
                      const LateralGrid& box, std::vector<Triangle>& triangles) {
    const auto& table = marching_cubes_table();
    std::uint32_t triangle = part[0]->first_triangle;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            if (!is_meshed(origin, x, y, box)) continue;
            unsigned whole = 0;
            for (unsigned cut = signs.cut_cells(x, y, whole); cut != 0; cut &= cut - 1) {
                const int z = std::countr_zero(cut);
                const auto vertex_on = [&](int edge) {
                    const int corner = edge_corner(edge);
                    const int i = x + (corner & 1), j = y + (corner >> 1 & 1), k = z + (corner >> 2);
                    const LeafEdges* leaf =
                        part[static_cast<std::size_t>((i >> 3) | (j >> 3) << 1 | (k >> 3) << 2)];
                    return leaf ? leaf->vertex(edge / 4, (i & 7) << 6 | (j & 7) << 3 | (k & 7)) : kNoVertex;
                };
                const auto& list = table[signs.pattern(x, y, z)];
                for (std::size_t e = 0; e < list.size(); e += 3)
                    triangles[triangle++] = {vertex_on(list[e]), vertex_on(list[e + 1]),
                                             vertex_on(list[e + 2])};
            }
        }
}

}  // namespace

void marching_cubes(const std::vector<const Leaf*>& all_leaves, const LateralGrid& box, TriangleMesh& mesh) {
    const std::vector<const Leaf*> in_columns =
        box.columns.empty() ? std::vector<const Leaf*>() : leaves_of_columns(all_leaves, box);
    const std::vector<const Leaf*>& leaves = box.columns.empty() ? all_leaves : in_columns;
    const std::size_t count = leaves.size();
    const LeafTable index(leaves);
    // Not set: many threads set each leaf's.
    const auto edges = std::make_unique_for_overwrite<LeafEdges[]>(count);
    const auto signs = std::make_unique_for_overwrite<LeafSigns[]>(count);
    parallel_each(count, 128, [&](std::size_t n) { signs[n] = LeafSigns(*leaves[n]); });
    const auto parts = [&](std::size_t n, auto&& of) {
        const openvdb::Coord o = leaves[n]->origin();
        Parts<std::remove_reference_t<decltype(of(n))>> part{&of(n)};
        for (int p = 1; p < 8; ++p) {
            const std::int32_t at =
                index.find((o.x() >> 3) + (p & 1), (o.y() >> 3) + (p >> 1 & 1), (o.z() >> 3) + (p >> 2));
            if (at >= 0) part[static_cast<std::size_t>(p)] = &of(static_cast<std::size_t>(at));
        }
        return part;
    };
    const auto signs_of = [&](std::size_t n) -> const LeafSigns& { return signs[n]; };

    std::atomic<bool> complete{true};
    parallel_each(count, 4, [&](std::size_t n) {
        const Parts<LeafSigns> part = parts(n, signs_of);
        bool in = false, out = false;
        for (const LeafSigns* p : part)
            if (p) in |= p->any_inside, out |= p->any_outside;
        if (!in || !out) {
            edges[n].vertices = edges[n].triangles = 0;
            return;
        }
        edges[n] = {};
        Signs all;
        all.load(part, leaves[n]->origin(), box);
        if (!mark_crossings(all, leaves[n]->origin(), box, edges[n])) complete = false;
        edges[n].vertices = edges[n].count();
    });
    if (!complete)
        throw NumericsError(
            "the narrow band does not enclose the surface; re-distance the level set before extracting");

    auto vertex_count = static_cast<std::uint32_t>(mesh.vertices.size()),
         triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
    for (LeafEdges& leaf : std::span(edges.get(), count)) {
        leaf.first_vertex = vertex_count;
        leaf.first_triangle = triangle_count;
        vertex_count += leaf.vertices;
        triangle_count += leaf.triangles;
    }

    mesh.vertices.resize(vertex_count);
    mesh.triangles.resize(triangle_count);
    parallel_each(count, 4, [&](std::size_t n) {
        if (edges[n].vertices > 0)
            place_vertices(edges[n], parts(n, [&](std::size_t k) -> const Leaf& { return *leaves[k]; }), box,
                           mesh.vertices);
        if (edges[n].triangles == 0) return;
        Signs all;
        all.load(parts(n, signs_of), leaves[n]->origin(), box);
        connect_vertices(parts(n, [&](std::size_t k) -> const LeafEdges& { return edges[k]; }), all,
                         leaves[n]->origin(), box, mesh.triangles);
    });
}

}  // namespace sidewall::surface
