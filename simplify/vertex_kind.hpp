#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::simplify {

/// Constraint of a vertex in edge collapses, from weak to strong. A merged vertex has the stronger of both.
enum class VertexKind : std::uint8_t {
    interior,  ///< off the open boundary: free
    boundary,  ///< on the open boundary, in no side plane, e.g. around a hole: may move along the boundary
    side,      ///< on the boundary, in side planes across one axis: may move along the boundary, in its plane
    corner,    ///< on the boundary, in side planes across x and y: stays where it is
    frozen     ///< where materials meet, or fixed by the caller: no edge that ends here collapses
};

/// Side planes of the mesh's box, as bits. A mesh without extent along an axis lies in both its planes.
enum SidePlane : std::uint8_t { kMinX = 1, kMaxX = 2, kMinY = 4, kMaxY = 8 };

struct VertexConstraint {
    VertexKind kind = VertexKind::interior;
    std::uint8_t planes = 0;  ///< SidePlane bits it must not leave; 0 off the boundary
};

/// The place allowed for the vertex that an edge collapses into.
enum class MergedPlace : std::uint8_t {
    nowhere,   ///< the edge must not collapse
    start,     ///< at the edge's start, unchanged
    end,       ///< at the edge's end, unchanged
    boundary,  ///< at the optimum on the boundary, in the side planes of both ends
    free       ///< at the optimum in space
};

namespace detail {

using enum MergedPlace;

// Allowed place by the kinds of both ends, after kCanCollapse of meshoptimizer's simplifier.cpp.
// - No end on the boundary: the place is free.
// - One end on the boundary: it stays, or the boundary would be drawn inwards.
// - Both ends on the boundary, same kind: the vertex moves along the boundary. Two corner vertices, one above
//   the other where two sides meet: the start stays.
// - Both ends on the boundary, different kinds: the stronger one stays; any other place would leave a plane.
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

/// The place allowed for the vertex that an edge collapses into: kMergedPlace of its ends, but `nowhere` if
/// both lie on the boundary and the edge runs through the interior (the collapse would pinch the surface), or
/// if the end kept does not lie in the side planes of both, e.g. for an edge from one side to the next.
/// \param boundary_edge  whether the edge itself lies on the open boundary.
inline MergedPlace merged_place(const VertexConstraint& start, const VertexConstraint& end,
                                bool boundary_edge) {
    const MergedPlace place =
        detail::kMergedPlace[static_cast<std::size_t>(start.kind)][static_cast<std::size_t>(end.kind)];
    if (start.kind == VertexKind::interior || end.kind == VertexKind::interior) return place;
    const std::uint8_t kept = place == MergedPlace::end ? end.planes : start.planes;
    return boundary_edge && (start.planes | end.planes) == kept ? place : MergedPlace::nowhere;
}

/// The constraint of the vertex that two vertices were merged into.
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

/// Moves \p p into the side planes \p planes (SidePlane bits) of the box from \p low to \p high.
inline void move_into(int planes, Vec3& p, const Vec3& low, const Vec3& high) {
    if (planes & kMinX) p.x() = low.x();
    if (planes & kMaxX) p.x() = high.x();
    if (planes & kMinY) p.y() = low.y();
    if (planes & kMaxY) p.y() = high.y();
}

/// Flags the vertices that no collapse may touch: where triangles of different `material` meet, or where
/// \p fixed (one flag a vertex, or empty) is set.
/// \throws GeometryError if `material` is not one finite number a triangle or \p fixed has another length
///         than the vertices.
std::vector<std::uint8_t> frozen_vertices(const TriangleMesh& mesh, std::span<const std::uint8_t> fixed);

}  // namespace sidewall::simplify
