#include "surface/extraction/bent_cells.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "surface/extraction/bent_nodes.hpp"
#include "surface/parallel.hpp"

namespace sidewall::surface {
namespace {

using openvdb::Coord;

constexpr double kSameDistance = 1e-6;  // cells: rounding difference of equal distances
constexpr double kAlike = 0.95;         // two planes with a larger cosine are one
constexpr double kOnPlane = 0.3;        // cells: a crossing farther from a plane is not on it

// Gives crossings whose planes are unsound that of the nearest sound one on a cell that they share.
void replace_unsound(const std::vector<BentCell>& cells, Crossings& crossings) {
    struct Nearest {
        double distance = 1.0;
        std::uint32_t crossing = kNone;
        double lift = 0.0;
        bool torn = false;  // unlike planes are equally near: none is taken, to keep mirror symmetry
    };
    std::vector<Nearest> nearest(crossings.plane.size());
    for (const BentCell& cell : cells)
        for (const Corner& bad : cell.loop) {
            const CrossingPlane& plane = crossings.plane[bad.crossing];
            if (plane.defect <= kUnsound || plane.normal.isZero()) continue;
            const Vec3 at = local_point(bad, plane);
            for (const Corner& other : cell.loop) {
                const CrossingPlane& sound = crossings.plane[other.crossing];
                if (sound.defect > kSound) continue;
                const Vec3 way = local_point(other, sound) - at;
                if (std::abs(sound.normal.dot(way)) > kOnPlane) continue;
                Nearest& best = nearest[bad.crossing];
                const double distance = way.norm();
                if (distance < best.distance - kSameDistance)
                    best = {distance, other.crossing, sound.normal.dot(way), false};
                else if (distance < best.distance + kSameDistance && best.crossing != kNone)
                    best.torn |= sound.normal.dot(crossings.plane[best.crossing].normal) < kAlike;
            }
        }
    crossings.lift.assign(crossings.plane.size(), 0.0);
    for (std::size_t n = 0; n < nearest.size(); ++n)
        if (nearest[n].crossing != kNone && !nearest[n].torn) {
            const CrossingPlane& sound = crossings.plane[nearest[n].crossing];
            crossings.plane[n].normal = sound.normal;
            crossings.plane[n].defect = sound.defect;
            crossings.lift[n] = nearest[n].lift;
        }
}

}  // namespace

Vec3 local_point(const Corner& corner, const CrossingPlane& plane) {
    const int c = edge_corner(corner.edge);
    Vec3 p(c & 1, c >> 1 & 1, c >> 2);
    p[corner.edge / 4] += plane.at;
    return p;
}

std::vector<BentCell> bent_cells(const CutLeaves& leaves, const LateralGrid& box) {
    const std::size_t count = leaves.size();
    std::vector<std::uint8_t> read(count, 0);
    for (std::size_t n = 0; n < count; ++n)
        if (leaves.edges(n).triangles > 0)
            for (const std::size_t part : leaves.parts(n, [](std::size_t k) { return k + 1; }))
                if (part > 0) read[part - 1] = 1;
    const auto bent = std::make_unique_for_overwrite<NodeBits[]>(count);
    std::vector<std::uint8_t> any(count, 0);  // by leaf: some node is bent
    parallel_each(count, 16, [&](std::size_t n) {
        if (read[n] == 0) return;
        bent[n] = bent_nodes(leaves, box, n);
        any[n] = std::ranges::any_of(bent[n], [](std::uint8_t row) { return row != 0; });
    });
    const auto& table = marching_cubes_table();
    std::vector<std::vector<BentCell>> by_leaf(count);
    parallel_each(count, 4, [&](std::size_t n) {
        if (leaves.edges(n).triangles == 0) return;
        const auto part = leaves.parts(
            n, [&](std::size_t k) -> const NodeBits* { return any[k] != 0 ? &bent[k] : nullptr; });
        if (std::ranges::all_of(part, [](const NodeBits* bits) { return bits == nullptr; })) return;
        RowBits rows;
        rows.load([&](std::size_t p) { return part[p]; });
        std::uint32_t triangle = leaves.edges(n).first_triangle;
        leaves.each_cell(n, leaves.signs(n), [&](int x, int y, int z, std::size_t pattern) {
            const std::uint32_t first = triangle;
            triangle += static_cast<std::uint32_t>(table[pattern].size() / 3);
            unsigned any = 0;
            for (int c = 0; c < 4; ++c) any |= rows.row[RowBits::at(x + (c & 1), y + (c >> 1))];
            if ((any >> z & 3u) == 0 || polygon_of(pattern).empty()) return;
            by_leaf[n].push_back(
                {leaves.leaf(n).origin() + Coord(x, y, z), static_cast<std::uint8_t>(pattern), first, {}});
        });
    });
    std::vector<BentCell> cells;
    for (auto& own : by_leaf)
        for (BentCell& cell : own) cells.push_back(std::move(cell));
    return cells;
}

Crossings find_crossings(const CutLeaves& leaves, const LateralGrid& box, std::vector<BentCell>& cells) {
    Crossings crossings;
    std::vector<std::uint32_t> number(leaves.vertices(), kNone);
    for (BentCell& cell : cells)
        for (const int edge : polygon_of(cell.pattern)) {
            const int c = edge_corner(edge);
            const Coord low = cell.cell + Coord(c & 1, c >> 1 & 1, c >> 2);
            // A node in the high side of a periodic axis is the image of one in the low side.
            Coord own = low;
            for (int a = 0; a < 2; ++a)
                if (const auto k = static_cast<std::size_t>(a); box.periodic[k] && own[a] == box.cells[k])
                    own[a] = 0;
            const std::uint32_t vertex = leaves.vertex_on(low, edge / 4);
            std::uint32_t first = own == low ? vertex : leaves.vertex_on(own, edge / 4);
            if (first == kNoVertex) first = vertex, own = low;  // the low side is of another level
            std::uint32_t& n = number[first];
            if (n == kNone) {
                n = static_cast<std::uint32_t>(crossings.edge.size());
                crossings.edge.emplace_back(own, edge / 4);
            }
            cell.loop.push_back({n, vertex, edge});
        }
    crossings.plane.resize(crossings.edge.size());
    parallel_each(crossings.edge.size(), 64, [&](std::size_t n) {
        NodeReader reader(leaves, box);
        crossings.plane[n] = crossing_plane(reader, crossings.edge[n].first, crossings.edge[n].second);
    });
    replace_unsound(cells, crossings);
    return crossings;
}

}  // namespace sidewall::surface
