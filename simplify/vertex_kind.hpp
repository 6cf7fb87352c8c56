#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Constraint of a vertex in an edge collapse, from weak to strong: a merged vertex has the stronger of the two.
enum class VertexKind : std::uint8_t {
    interior,  ///< off the open boundary: nothing holds it
    boundary,  ///< on the open boundary, in no side plane, e.g. around a hole: it may move along the boundary
    side,      ///< on the boundary, in side planes across one axis: likewise, and it stays in the plane
    corner,    ///< on the boundary, in side planes across x and y: it stays where it is
    frozen     ///< where materials meet, or fixed by the caller: no edge that ends here collapses
};

/// Side planes of the mesh's box, as bits. A mesh of no extent along an axis lies in both planes across it.
enum SidePlane : std::uint8_t { kMinX = 1, kMaxX = 2, kMinY = 4, kMaxY = 8 };

struct VertexConstraint {
    VertexKind kind = VertexKind::interior;
    std::uint8_t planes = 0;  ///< SidePlanes it must not leave; none off the boundary
};

/// The place allowed for the vertex that an edge collapses into.
enum class MergedPlace : std::uint8_t {
    nowhere,   ///< the edge must not collapse
    start,     ///< at the edge's start, as it is
    end,       ///< at the edge's end, as it is
    boundary,  ///< where the boundary loses the least, in the side planes of both ends
    free       ///< wherever the surface loses the least
};

namespace detail {

using enum MergedPlace;

// Kind by kind, after kCanCollapse of meshoptimizer's simplifier.cpp.
// - No end on the boundary: the place is free.
// - One end on the boundary: that one stays, or the boundary would be drawn inwards.
// - Both on it and of one kind: along it. Of two vertices at one corner of the box, one above the other where
//   two sides meet, either may go.
// - Both on it and of two kinds: the stronger stays; elsewhere it would leave a plane.
// clang-format off
inline constexpr MergedPlace kMergedPlace[5][5] = {
    // start \ end    interior  boundary  side      corner   frozen
    /* interior */ {free,     end,      end,      end,     nowhere},
    /* boundary */ {start,    boundary, end,      end,     nowhere},
    /* side     */ {start,    start,    boundary, end,     nowhere},
    /* corner   */ {start,    start,    start,    start,   nowhere},
    /* frozen   */ {nowhere,  nowhere,  nowhere,  nowhere, nowhere}};
// clang-format on

}  // namespace detail

/// The place allowed for the vertex that an edge collapses into, by the constraints of its ends. It is nowhere,
/// too, if both lie on the boundary but the edge runs through the interior, where the collapse would pinch the
/// surface; and if no end lies in all the planes that hold either, e.g. across from one side to the next.
/// \param boundary_edge  the edge itself is one of the open boundary.
inline MergedPlace merged_place(const VertexConstraint& start, const VertexConstraint& end,
                                bool boundary_edge) {
    const MergedPlace place =
        detail::kMergedPlace[static_cast<std::size_t>(start.kind)][static_cast<std::size_t>(end.kind)];
    if (start.kind == VertexKind::interior || end.kind == VertexKind::interior) return place;
    const std::uint8_t kept = place == MergedPlace::end ? end.planes : start.planes;
    return boundary_edge && (start.planes | end.planes) == kept ? place : MergedPlace::nowhere;
}

/// The constraint of the vertex that two were merged into.
inline VertexConstraint merged(const VertexConstraint& a, const VertexConstraint& b) {
    return {std::max(a.kind, b.kind), static_cast<std::uint8_t>(a.planes | b.planes)};
}

/// The constraint of a vertex on the open boundary of a mesh of the given box.
inline VertexConstraint boundary_constraint(const Vec3& p, const Box3& box) {
    const bool min_x = p.x() == box.min.x(), max_x = p.x() == box.max.x();
    const bool min_y = p.y() == box.min.y(), max_y = p.y() == box.max.y();
    VertexKind kind = VertexKind::boundary;
    if (min_x || max_x || min_y || max_y) kind = VertexKind::side;
    if ((min_x || max_x) && (min_y || max_y)) kind = VertexKind::corner;
    return {kind, static_cast<std::uint8_t>(min_x * kMinX + max_x * kMaxX + min_y * kMinY + max_y * kMaxY)};
}

/// Moves \p p into the given side planes of the box from \p low to \p high.
inline void move_into(int planes, Vec3& p, const Vec3& low, const Vec3& high) {
    if (planes & kMinX) p.x() = low.x();
    if (planes & kMaxX) p.x() = high.x();
    if (planes & kMinY) p.y() = low.y();
    if (planes & kMaxY) p.y() = high.y();
}

/// Flags the vertices that no collapse may touch: those where triangles of different `material` meet, and those
/// with \p fixed set, one flag a vertex or empty.
/// \throws GeometryError if `material` is not one finite number a triangle or \p fixed has another length than
///         the vertices.
std::vector<std::uint8_t> frozen_vertices(const TriangleMesh& mesh, std::span<const std::uint8_t> fixed);

}  // namespace sidewall::simplify
