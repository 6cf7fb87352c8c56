#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// The two faces of a hollow corner, which a facet of unit normal share[0] * normal[0] + share[1] * normal[1] cuts off:
///
///        |
///        |  normal[1] -->        A grid draws the corner of a wall and a floor as a facet one cell wide. A particle that
///        |                       meets the facet would have met the wall or the floor, at that face's incidence.
///         \   facet
///          \ ____________
///              normal[0] up
struct CutCorner {
    std::array<Vec3, 2> normal;
    std::array<double, 2> share;  ///< areas of the faces that a unit area of the facet stands for
};

/// The corner between a face that looks \p towards a particle and the one of the two that lies on the other side of the facet's
/// normal \p n; \p corner itself if no such face has room between the two.
CutCorner facing(const CutCorner& corner, const Vec3& n, const Vec3& towards);

/// Corners that facets cut off, by triangle.
struct CutCorners {
    std::vector<std::int32_t> of;  ///< index into corners, or -1; empty: there are none
    std::vector<CutCorner> corners;
    const CutCorner* at(std::uint32_t triangle) const {
        return of.empty() || of[triangle] < 0 ? nullptr : &corners[static_cast<std::size_t>(of[triangle])];
    }
};

/// Facets of \p mesh, up to 1.5 grid spacings wide across the corner's edge, between faces that rise above their plane on both
/// sides: the nearest on which the surface no longer bends, or what there is within 5 spacings. Where it curves by a radius
/// above 5 spacings, or lies over 2 above the faces' edge, there is no corner.
/// \param spacing  of the grid that the mesh comes from; length unit. 0: none are looked for.
/// \note O(triangles), parallel, deterministic.
CutCorners find_cut_corners(const TriangleMesh& mesh, double spacing);

}  // namespace sidewall::flux
