#include "surface/extraction/cut_leaves.hpp"

#include <atomic>
#include <cmath>
#include <span>

#include "surface/error.hpp"
#include "surface/extraction/crossing_planes.hpp"
#include "surface/parallel.hpp"

namespace sidewall::surface {
namespace {

// Whether the edges along an axis at a row of nodes get vertices, by the columns of the cells beside them.
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

// The leaves with nodes of cells that get vertices or triangles.
std::vector<const FloatLeaf*> leaves_of_columns(const std::vector<const FloatLeaf*>& leaves,
                                                const LateralGrid& box) {
    std::vector<const FloatLeaf*> kept;
    for (const FloatLeaf* leaf : leaves) {
        const openvdb::Coord o = leaf->origin();
        bool any = false;
        for (int i = o.x() - 1; i < o.x() + 8 && !any; ++i)
            for (int j = o.y() - 1; j < o.y() + 8 && !any; ++j)
                any = column_at(i, j, box) >= CellColumn::vertices;
        if (any) kept.push_back(leaf);
    }
    return kept;
}

}  // namespace

std::uint32_t LeafEdges::count() {
    std::uint32_t n = 0;
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t w = 0; w < 8; ++w) {
            rank[a][w] = n;
            n += static_cast<std::uint32_t>(std::popcount(crossed[a][w]));
        }
    return n;
}

LeafSigns::LeafSigns(const FloatLeaf& leaf, float on_node) {
    unsigned in = 0, out = 0, on = 0;
    const float* v = leaf.buffer().data();
    for (std::size_t row = 0; row < 64; ++row, v += 8) {
        unsigned negative = 0;
        for (unsigned z = 0; z < 8; ++z) {
            negative |= static_cast<unsigned>(v[z] < 0.0f) << z;
            on |= static_cast<unsigned>(std::abs(v[z]) < on_node);
        }
        const unsigned all = leaf.getValueMask().getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
        known[row] = static_cast<std::uint8_t>(all);
        inside[row] = static_cast<std::uint8_t>(all & negative);
        in |= all & negative;
        out |= all & ~negative;
    }
    any_inside = in != 0, any_outside = out != 0, any_on_surface = on != 0;
}

void Signs::load(const Parts<LeafSigns>& part, const openvdb::Coord& origin, const LateralGrid& box) {
    known.load([&](std::size_t p) { return part[p] ? &part[p]->known : nullptr; });
    inside.load([&](std::size_t p) { return part[p] ? &part[p]->inside : nullptr; });
    const auto beyond = [&](int axis, int i) {
        const int node = origin[axis] + i;
        return node < 0 || node > box.cells[static_cast<std::size_t>(axis)];
    };
    for (int x = 0; x < RowBits::kSide; ++x)
        for (int y = 0; y < RowBits::kSide; ++y)
            if (beyond(0, x) || beyond(1, y))
                known.row[RowBits::at(x, y)] = inside.row[RowBits::at(x, y)] = 0;
}

unsigned Signs::cut_cells(int x, int y, unsigned& whole) const {
    unsigned in = 0, out = 0, all = 0xffffu;
    for (int c = 0; c < 4; ++c) {
        const std::size_t r = RowBits::at(x + (c & 1), y + (c >> 1));
        const unsigned k = known.row[r], i = inside.row[r], o = k & ~i;
        in |= i | i >> 1, out |= o | o >> 1, all &= k & k >> 1;
    }
    whole = all;
    return in & out & 0xffu;
}

std::size_t Signs::pattern(int x, int y, int z) const {
    unsigned pattern = 0;
    for (int c = 0; c < 4; ++c) {
        const unsigned r = inside.row[RowBits::at(x + (c & 1), y + (c >> 1))] >> z;
        pattern |= (r & 1u) << c | (r >> 1 & 1u) << (4 + c);
    }
    return pattern;
}

CellColumn column_at(int i, int j, const LateralGrid& box) {
    if (i < 0 || j < 0 || i >= box.cells[0] || j >= box.cells[1]) return CellColumn::left_out;
    return box.columns.empty() ? CellColumn::meshed
                               : box.columns[static_cast<std::size_t>(i * box.cells[1] + j)];
}

CutLeaves::CutLeaves(const std::vector<const FloatLeaf*>& leaves, const LateralGrid& box,
                     const TriangleMesh& mesh)
    : box_(box),
      in_columns_(box.columns.empty() ? std::vector<const FloatLeaf*>() : leaves_of_columns(leaves, box)),
      leaves_(box.columns.empty() ? &leaves : &in_columns_),
      index_(*leaves_),
      edges_(std::make_unique_for_overwrite<LeafEdges[]>(size())),
      signs_(std::make_unique_for_overwrite<LeafSigns[]>(size())),
      vertices_(static_cast<std::uint32_t>(mesh.vertices.size())),
      triangles_(static_cast<std::uint32_t>(mesh.triangles.size())) {
    parallel_each(size(), 128, [&](std::size_t n) {
        signs_[n] = LeafSigns(leaf(n), static_cast<float>(box.on_node));
        if (signs_[n].any_on_surface) set_sides_on_surface(n);
    });
    std::atomic<bool> complete{true};
    parallel_each(size(), 4, [&](std::size_t n) {
        bool in = false, out = false;
        for (const LeafSigns* p : sign_parts(n))
            if (p) in |= p->any_inside, out |= p->any_outside;
        if (!in || !out) {
            edges_[n].vertices = edges_[n].triangles = 0;
            edges_[n].crossed = {};
            return;
        }
        edges_[n] = {};
        if (!mark_crossings(signs(n), n)) complete = false;
        edges_[n].vertices = edges_[n].count();
    });
    if (!complete)
        throw NumericsError(
            "the narrow band does not enclose the surface; re-distance the level set before extracting");
    for (LeafEdges& own : std::span(edges_.get(), size())) {
        own.first_vertex = vertices_;
        own.first_triangle = triangles_;
        vertices_ += own.vertices;
        triangles_ += own.triangles;
    }
}

// Decides for a leaf's nodes on the surface whether they are inside.
void CutLeaves::set_sides_on_surface(std::size_t n) {
    const FloatLeaf& own = leaf(n);
    LeafSigns& signs = signs_[n];
    NodeReader value(*this, box_);
    for (auto it = own.cbeginValueOn(); it; ++it) {
        if (std::abs(static_cast<double>(*it)) >= box_.on_node) continue;
        const auto bit = static_cast<std::uint8_t>(1u << (it.pos() & 7u));
        std::uint8_t& row = signs.inside[it.pos() >> 3];
        const bool inside = value.inside(it.getCoord());
        row = static_cast<std::uint8_t>(inside ? row | bit : row & ~bit);
        (inside ? signs.any_inside : signs.any_outside) = true;
    }
}

Signs CutLeaves::signs(std::size_t n) const {
    Signs all;
    all.load(sign_parts(n), leaf(n).origin(), box_);
    return all;
}

// Marks the edges that the surface crosses and counts the triangles of the leaf's own cells.
// \returns whether all corners of the cells that the surface passes through are known.
bool CutLeaves::mark_crossings(const Signs& signs, std::size_t n) {
    const auto& table = marching_cubes_table();
    const openvdb::Coord origin = leaf(n).origin();
    LeafEdges& own = edges_[n];
    bool complete = true;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
            const auto mark = [&](int axis, unsigned row) {
                if (row == 0 || (!box_.columns.empty() && !has_vertices(origin, x, y, axis, box_))) return;
                own.crossed[static_cast<std::size_t>(axis)][static_cast<std::size_t>(x)] |= std::uint64_t{row}
                                                                                            << (8 * y);
            };
            mark(0, signs.crossed(x, y, x + 1, y));
            mark(1, signs.crossed(x, y, x, y + 1));
            mark(2, signs.crossed(x, y));
            if (column_at(origin.x() + x, origin.y() + y, box_) != CellColumn::meshed) continue;
            unsigned whole = 0;
            unsigned cut = signs.cut_cells(x, y, whole);
            complete = complete && (cut & ~whole) == 0;
            for (cut &= whole; cut != 0; cut &= cut - 1)
                own.triangles +=
                    static_cast<std::uint32_t>(table[signs.pattern(x, y, std::countr_zero(cut))].size() / 3);
        }
    return complete;
}

const FloatLeaf* CutLeaves::leaf_at(const openvdb::Coord& node) const {
    const std::int32_t n = index_.find(node.x() >> 3, node.y() >> 3, node.z() >> 3);
    return n < 0 ? nullptr : &leaf(static_cast<std::size_t>(n));
}

std::uint32_t CutLeaves::vertex_on(const openvdb::Coord& node, int axis) const {
    const std::int32_t n = index_.find(node.x() >> 3, node.y() >> 3, node.z() >> 3);
    if (n < 0) return kNoVertex;
    const LeafEdges& own = edges_[static_cast<std::size_t>(n)];
    const int at = (node.x() & 7) << 6 | (node.y() & 7) << 3 | (node.z() & 7);
    const bool crossed =
        own.crossed[static_cast<std::size_t>(axis)][static_cast<std::size_t>(at >> 6)] >> (at & 63) & 1;
    return crossed ? own.vertex(axis, at) : kNoVertex;
}

}  // namespace sidewall::surface
