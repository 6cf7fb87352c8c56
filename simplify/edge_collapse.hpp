#pragma once
#include <array>
#include <cstdint>

#include "simplify/collapse_mesh.hpp"
#include "simplify/deviation.hpp"

namespace sidewall::simplify {

/// Twice the area vector of a triangle that stays, before and after a collapse.
struct Change {
    Vec3 before, after;
};

/// Everything around an edge that is about to collapse.
struct Surroundings {
    OneRing start, end;
    std::array<MovedTriangle, 2 * OneRing::kMost> moved;
    std::array<Change, 2 * OneRing::kMost> changes;
    std::size_t count = 0;                ///< of the two above
    std::array<std::uint32_t, 2> gone{};  ///< triangles that go
    std::array<std::uint32_t, 2> apex{};  ///< third corners of the triangles that go
    std::size_t apexes = 0;
    Deviation::Plan plan;  ///< if the distance is bounded
};

/// Whether an edge can go to \p place without damage: the link condition holds, no triangle turns by 90
/// degrees or more, none becomes a sliver or a worse one, no neighbours fold that did not before. Fills in the surroundings, all but the plan.
/// O(degree).
bool can_collapse(const CollapseMesh& mesh, std::uint32_t halfedge, const Vec3& place, Surroundings& around);

/// Collapses it: its start moves to \p place, its end and the one or two triangles beside it go, all sums
/// follow.
/// \pre can_collapse has just passed. O(degree).
void collapse_edge(CollapseMesh& mesh, std::uint32_t halfedge, const Vec3& place, const Surroundings& around);

}  // namespace sidewall::simplify
