#pragma once
#include <array>
#include <cstdint>
#include <span>

#include "simplify/collapse_mesh.hpp"
#include "simplify/deviation.hpp"

namespace sidewall::simplify {

/// Twice the area vector of a remaining triangle before and after a collapse.
struct Change {
    Vec3 before, after;
};

/// The triangles around an edge that is about to collapse: halfedge h from v0 to v1. v0 moves to the new
/// place; v1 and the triangles tl and tr vanish. At a boundary edge there are only vl and tl.
/// \verbatim
///         vl
///       .'  '.
///     .'  tl  '.
///   v0 ---h---> v1
///     '.  tr  .'
///       '.  .'
///         vr
/// \endverbatim
struct Surroundings {
    OneRing start, end;  ///< rings of v0 and v1
    std::array<MovedTriangle, 2 * OneRing::kMost> moved;
    std::array<Change, 2 * OneRing::kMost> changes;
    std::size_t count = 0;                ///< entries of `moved` and of `changes`
    std::array<std::uint32_t, 2> gone{};  ///< tl, tr
    std::array<std::uint32_t, 2> apex{};  ///< vl, vr
    std::size_t apexes = 0;               ///< 2, or 1 at a boundary edge
    Deviation::Plan plan;                 ///< filled in by Deviation::within, if the distance is bounded

    std::span<const MovedTriangle> triangles_moved() const { return std::span(moved).first(count); }
    std::span<const std::uint32_t> triangles_gone() const { return std::span(gone).first(apexes); }
};

/// Whether an edge can collapse to \p place without damage to the mesh: the link condition holds, no triangle
/// turns by 90 degrees or more, becomes a sliver (or a worse one) or comes to lie in a side plane, and no new
/// fold appears between neighbours. Fills in the surroundings except the plan. O(degree).
bool can_collapse(const CollapseMesh& mesh, std::uint32_t halfedge, const Vec3& place, Surroundings& around);

/// Collapses an edge: its start moves to \p place, its end and the triangles beside it vanish. O(degree).
/// \pre can_collapse() has just returned true for it.
void collapse_edge(CollapseMesh& mesh, std::uint32_t halfedge, const Vec3& place, const Surroundings& around);

}  // namespace sidewall::simplify
