#pragma once
#include <openvdb/Grid.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "surface/extraction/leaf_table.hpp"
#include "surface/extraction/marching_cubes.hpp"

// Grid edges that the surface crosses and cells that it passes through, by leaf. Internal to this folder.
namespace sidewall::surface {

inline constexpr std::uint32_t kNoVertex = 0xffffffffu;

/// A leaf's own edges (from each node towards +x, +y, +z) that the surface crosses, as bit sets. A vertex's
/// number is the leaf's first number plus the rank of its bit, so no per-edge table is needed.
struct LeafEdges {
    std::array<std::array<std::uint64_t, 8>, 3> crossed;
    std::array<std::array<std::uint32_t, 8>, 3> rank;  // set bits before each word
    std::uint32_t first_vertex, first_triangle, vertices, triangles;

    std::uint32_t vertex(int axis, int node) const {
        const auto a = static_cast<std::size_t>(axis), w = static_cast<std::size_t>(node >> 6);
        const std::uint64_t before = crossed[a][w] & ((std::uint64_t{1} << (node & 63)) - 1);
        return first_vertex + rank[a][w] + static_cast<std::uint32_t>(std::popcount(before));
    }
    std::uint32_t count();
};

/// The nodes of a leaf that are known (active voxels of the band) and that lie inside: bit z of byte 8 x + y.
struct LeafSigns {
    std::array<std::uint8_t, 64> known, inside;
    bool any_inside, any_outside, any_on_surface;

    LeafSigns() = default;
    /// \param on_node  LateralGrid::on_node.
    LeafSigns(const FloatLeaf& leaf, float on_node);
};

/// Data of a leaf and of those on its high sides: at +x for bit 0 of the index, +y for bit 1, +z for bit 2.
/// Null where there is no leaf.
template <class T>
using Parts = std::array<const T*, 8>;

/// A bit set of the nodes of a leaf: bit z of byte 8 x + y.
using NodeBits = std::array<std::uint8_t, 64>;

/// The bits of a leaf's 8^3 nodes and of one more layer on the high sides: bit z of a row of nine nodes.
struct RowBits {
    static constexpr int kSide = 9;
    std::array<std::uint16_t, kSide * kSide> row;

    static std::size_t at(int x, int y) { return static_cast<std::size_t>(x * kSide + y); }
    /// \param bits  gives the bits of part p, null if there is none.
    template <class Bits>
    void load(Bits&& bits) {
        for (int x = 0; x < kSide; ++x)
            for (int y = 0; y < kSide; ++y) {
                const auto column = static_cast<std::size_t>((x >> 3) | (y >> 3) << 1),
                           r = static_cast<std::size_t>((x & 7) << 3 | (y & 7));
                const NodeBits *low = bits(column), *high = bits(column | 4);
                row[at(x, y)] =
                    static_cast<std::uint16_t>((low ? (*low)[r] : 0u) | (high ? ((*high)[r] & 1u) << 8 : 0u));
            }
    }
};

/// The signs at a leaf's nodes and one more layer on the high sides; nodes beyond the box are unknown.
struct Signs {
    RowBits known, inside;

    void load(const Parts<LeafSigns>& part, const openvdb::Coord& origin, const LateralGrid& box);

    /// The edges from the row at (x, y) to the one at (i, j) that the surface crosses, by their z.
    unsigned crossed(int x, int y, int i, int j) const {
        const std::size_t a = RowBits::at(x, y), b = RowBits::at(i, j);
        return (inside.row[a] ^ inside.row[b]) & known.row[a] & known.row[b] & 0xffu;
    }
    /// The edges along the row that the surface crosses.
    unsigned crossed(int x, int y) const {
        const unsigned in = inside.row[RowBits::at(x, y)], all = known.row[RowBits::at(x, y)];
        return (in ^ in >> 1) & all & all >> 1 & 0xffu;
    }
    /// The cells between (x, y) and (x + 1, y + 1) with corners inside and outside, by their z; \p whole:
    /// cells whose corners are all known.
    unsigned cut_cells(int x, int y, unsigned& whole) const;
    /// Bit c: corner c of the cell at (x, y, z) lies inside; see marching_cubes_table.
    std::size_t pattern(int x, int y, int z) const;
};

/// What is made of a column of cells; those beyond the box are left out.
CellColumn column_at(int i, int j, const LateralGrid& box);

/// World coordinate of node \p i; the sides are hit to the last bit.
inline double node_coordinate(const LateralGrid& box, int axis, int i) {
    if (axis == 2) return i * box.spacing;
    const auto a = static_cast<std::size_t>(axis);
    return i == box.cells[a] ? box.max[a] : box.min[a] + i * box.spacing;
}

/// All leaves and what the surface cuts in them. Vertex and triangle numbers continue those of a mesh.
class CutLeaves {
  public:
    /// \throws NumericsError if the band is too thin to hold the cells that the surface passes through.
    CutLeaves(const std::vector<const FloatLeaf*>& leaves, const LateralGrid& box, const TriangleMesh& mesh);

    std::size_t size() const { return leaves_->size(); }
    const FloatLeaf& leaf(std::size_t n) const { return *(*leaves_)[n]; }
    const LeafEdges& edges(std::size_t n) const { return edges_[n]; }
    /// Final numbers of vertices and triangles, those of the mesh included.
    std::uint32_t vertices() const { return vertices_; }
    std::uint32_t triangles() const { return triangles_; }

    /// By part p of leaf n: what of(number of that leaf) gives, null where there is no leaf.
    template <class Of>
    auto parts(std::size_t n, Of&& of) const {
        const openvdb::Coord o = leaf(n).origin();
        std::array<decltype(of(n)), 8> part{of(n)};
        for (int p = 1; p < 8; ++p) {
            const std::int32_t at =
                index_.find((o.x() >> 3) + (p & 1), (o.y() >> 3) + (p >> 1 & 1), (o.z() >> 3) + (p >> 2));
            if (at >= 0) part[static_cast<std::size_t>(p)] = of(static_cast<std::size_t>(at));
        }
        return part;
    }

    Parts<FloatLeaf> leaf_parts(std::size_t n) const {
        return parts(n, [&](std::size_t k) -> const FloatLeaf* { return &leaf(k); });
    }
    Parts<LeafEdges> edge_parts(std::size_t n) const {
        return parts(n, [&](std::size_t k) -> const LeafEdges* { return &edges_[k]; });
    }
    Signs signs(std::size_t n) const;
    /// The leaf of a node, or null; the vertex on the edge from a node along an axis, or kNoVertex.
    const FloatLeaf* leaf_at(const openvdb::Coord& node) const;
    std::uint32_t vertex_on(const openvdb::Coord& node, int axis) const;

    /// Calls use(x, y, z, pattern) for the leaf's own cells that are meshed, in the order of their triangles.
    template <class Use>
    void each_cell(std::size_t n, const Signs& signs, Use&& use) const {
        const openvdb::Coord o = leaf(n).origin();
        for (int x = 0; x < 8; ++x)
            for (int y = 0; y < 8; ++y) {
                if (column_at(o.x() + x, o.y() + y, box_) != CellColumn::meshed) continue;
                unsigned whole = 0;
                for (unsigned cut = signs.cut_cells(x, y, whole) & whole; cut != 0; cut &= cut - 1) {
                    const int z = std::countr_zero(cut);
                    use(x, y, z, signs.pattern(x, y, z));
                }
            }
    }

  private:
    Parts<LeafSigns> sign_parts(std::size_t n) const {
        return parts(n, [&](std::size_t k) -> const LeafSigns* { return &signs_[k]; });
    }
    void set_sides_on_surface(std::size_t n);
    bool mark_crossings(const Signs& signs, std::size_t n);

    LateralGrid box_;
    std::vector<const FloatLeaf*> in_columns_;
    const std::vector<const FloatLeaf*>* leaves_;
    LeafTable index_;
    // Uninitialised at first: many threads set them, leaf by leaf.
    std::unique_ptr<LeafEdges[]> edges_;
    std::unique_ptr<LeafSigns[]> signs_;
    std::uint32_t vertices_, triangles_;
};

}  // namespace sidewall::surface
