#include "surface/extraction/fans.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "surface/parallel.hpp"

namespace sidewall::surface {
namespace {

using openvdb::Coord;

constexpr double kEdgeCosine = 0.8;  // planes over 37 degrees apart make an edge
constexpr double kRank = 0.1;        // eigenvalues of a quadric below this share of the largest count as 0
constexpr double kInside = 1e-3;     // cells: distance of apices from the faces of their box
constexpr double kReach = 0.5;       // cells: an apex farther outside its box is dropped
constexpr double kBeside = 0.05;     // cells: an apex no farther outside lies on the box

// The point nearest to the crossings' mean in which their planes meet (least squares), and the rank: how many
// directions the planes fix.
std::pair<Vec3, int> meeting_point(const BentCell& cell, const Crossings& crossings, Vec3& mean) {
    mean = Vec3::Zero();
    for (const Corner& c : cell.loop) mean += local_point(c, crossings.plane[c.crossing]);
    mean /= static_cast<double>(cell.loop.size());
    Eigen::Matrix3d quadric = Eigen::Matrix3d::Zero();
    Vec3 right = Vec3::Zero();
    for (const Corner& c : cell.loop) {
        const CrossingPlane& plane = crossings.plane[c.crossing];
        const double weight = 1.0 / (1.0 + plane.defect * plane.defect / (kUnsound * kUnsound));
        const Vec3& n = plane.normal;
        const double offset = n.dot(local_point(c, plane) - mean) + crossings.lift[c.crossing];
        quadric += weight * n * n.transpose();
        right += weight * offset * n;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(quadric);
    Vec3 from_mean = Vec3::Zero();
    int rank = 0;
    for (int k = 0; k < 3; ++k) {
        if (solver.eigenvalues()[k] < kRank * solver.eigenvalues()[2]) continue;
        const Vec3 direction = solver.eigenvectors().col(k);
        from_mean += direction * (direction.dot(right) / solver.eigenvalues()[k]);
        ++rank;
    }
    return {mean + from_mean, rank};
}

bool has_edge(const BentCell& cell, const Crossings& crossings) {
    for (std::size_t i = 0; i < cell.loop.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const CrossingPlane &a = crossings.plane[cell.loop[i].crossing],
                                &b = crossings.plane[cell.loop[j].crossing];
            if (a.defect <= kUnsound && b.defect <= kUnsound && a.normal.dot(b.normal) < kEdgeCosine)
                return true;
        }
    return false;
}

// Whether two planes make an angle below 37 degrees: at a cusp of curved faces, planes meet far beyond it.
bool is_cusp(const BentCell& cell, const Crossings& crossings) {
    for (const Corner& a : cell.loop)
        for (const Corner& b : cell.loop)
            if (crossings.plane[a.crossing].normal.dot(crossings.plane[b.crossing].normal) < -kEdgeCosine)
                return true;
    return false;
}

// The own cell that a cell beyond a periodic side repeats.
Coord source_cell(const LateralGrid& box, Coord cell) {
    for (int a = 0; a < 2; ++a) {
        const auto k = static_cast<std::size_t>(a);
        if (box.periodic[k]) cell[a] = (cell[a] + box.cells[k]) % box.cells[k];
    }
    return cell;
}

// Whether the surface does not cut a cell: all its corners are known and on one side. False for cells beyond
// the domain, except those beyond a periodic side if \p beyond.
bool is_uncut(NodeReader& value, const LateralGrid& box, Coord cell, bool beyond) {
    if (beyond) cell = source_cell(box, cell);
    if (cell.x() < 0 || cell.y() < 0 || cell.x() >= box.cells[0] || cell.y() >= box.cells[1]) return false;
    int inside = 0, outside = 0;
    for (int c = 0; c < 8; ++c) {
        const Coord corner = cell + Coord(c & 1, c >> 1 & 1, c >> 2);
        if (std::isnan(value(corner))) return false;
        ++(value.inside(corner) ? inside : outside);
    }
    return inside == 8 || outside == 8;
}

// The fan of a cell, if its planes make an edge that is allowed there.
std::optional<Fan> fan_of(const BentCell& cell, const Crossings& crossings, NodeReader& value,
                          const LateralGrid& box, SharpEdges which) {
    const SharpEdges kinds =
        box.edges_in ? std::min(which, box.edges_in({cell.cell.x(), cell.cell.y(), cell.cell.z()})) : which;
    if (kinds == SharpEdges::none) return {};
    Vec3 mean;
    const auto [apex, rank] = meeting_point(cell, crossings, mean);
    Vec3 outwards = Vec3::Zero();
    for (const Corner& c : cell.loop) outwards += crossings.plane[c.crossing].normal;
    const bool convex = outwards.dot(apex - mean) > 0.0;
    if (!apex.allFinite() || (convex && kinds == SharpEdges::hollow)) return {};
    Fan fan{&cell, apex, rank == 3 ? EdgeKind::corner : convex ? EdgeKind::convex : EdgeKind::hollow,
            {},    {},   {}};
    int beyond = 0, axis = 0;
    for (int a = 0; a < 3; ++a)
        if (apex[a] < 0.0 || apex[a] > 1.0) ++beyond, axis = a;
    if (beyond == 1 && !is_cusp(cell, crossings)) {
        Coord beside = cell.cell;
        const int way = apex[axis] > 0.5 ? 1 : -1;
        beside[axis] += way;
        if (is_uncut(value, box, beside, which == SharpEdges::all_beyond))
            fan.taken[static_cast<std::size_t>(axis)] = way;
    }
    return fan;
}

// Clamps an apex to its box. \returns whether it was near enough, and not beyond an edge of the box.
bool confine(Fan& fan) {
    double most = 0.0;
    int beyond = 0;
    for (int a = 0; a < 3; ++a) {
        const int way = fan.taken[static_cast<std::size_t>(a)];
        const double before = fan.apex[a];
        fan.apex[a] = std::clamp(before, way + kInside, way + 1.0 - kInside);
        most = std::max(most, std::abs(fan.apex[a] - before));
        beyond += std::abs(fan.apex[a] - before) > kBeside;
    }
    return most <= kReach && beyond < 2;
}

}  // namespace

std::vector<Fan> find_fans(const CutLeaves& leaves, const LateralGrid& box,
                           const std::vector<BentCell>& cells, const Crossings& crossings, SharpEdges which) {
    std::vector<std::uint8_t> sharp(cells.size());
    parallel_each(cells.size(), 64, [&](std::size_t n) { sharp[n] = has_edge(cells[n], crossings); });
    std::vector<const BentCell*> of;
    for (std::size_t n = 0; n < cells.size(); ++n)
        if (sharp[n] != 0) of.push_back(&cells[n]);
    std::vector<std::optional<Fan>> found(of.size());
    parallel_each(of.size(), 32, [&](std::size_t n) {
        NodeReader value(leaves, box);
        found[n] = fan_of(*of[n], crossings, value, box, which);
    });
    // A cell that several fans would take goes to none.
    std::map<Coord, int> takers;
    const auto beside = [&](const Fan& fan) {
        return source_cell(box, fan.of->cell + Coord(fan.taken[0], fan.taken[1], fan.taken[2]));
    };
    for (const std::optional<Fan>& fan : found)
        if (fan && fan->taken != std::array<int, 3>{}) ++takers[beside(*fan)];
    std::vector<Fan> fans;
    for (std::optional<Fan>& fan : found) {
        if (!fan) continue;
        if (fan->taken != std::array<int, 3>{} && takers[beside(*fan)] > 1) fan->taken = {};
        if (confine(*fan)) fans.push_back(std::move(*fan));
    }
    return fans;
}

}  // namespace sidewall::surface
