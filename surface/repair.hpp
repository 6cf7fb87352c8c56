#pragma once
#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// What repair() changed.
struct Repairs {
    std::size_t triangles = 0;  ///< in the repaired mesh, lids not counted
    std::size_t unused = 0;     ///< vertices that no triangle uses, dropped
    std::size_t welded = 0;     ///< vertices merged into another of the same position
    std::size_t nearby = 0;     ///< vertices merged into another within `reach`
    double reach = 0.0;         ///< distance up to which vertices are merged; 0 where no edge is open
    std::size_t collapsed = 0;  ///< triangles with two corners in one vertex, dropped
    std::size_t repeated = 0;   ///< triangles of the same three vertices as another, dropped
    std::size_t turned = 0;     ///< triangles whose vertex order was reversed
    std::size_t closed = 0;     ///< openings closed by a lid
};

/// Options of repair().
struct RepairOptions {
    /// Whether pieces are oriented towards the gas; else only the triangles within a piece are made to agree.
    bool face_gas = true;
    /// Whether to close the opening with this rim; attributes are lost then. Empty: none is closed.
    std::function<bool(std::span<const Vec3>)> closes = {};
};

/// Repairs meshes of other programs so that they separate gas from material, where only one repair is right.
///
/// - Vertices at the same position are merged if that pairs up open edges; some formats repeat vertices.
/// - If open edges remain, their vertices are merged within what rounding explains: 1e-5 of the mesh's
///   diagonal and at most a tenth of its median edge. Corners of one triangle are never merged.
/// - Unused vertices and repeated triangles are dropped; the first of repeated ones stays. Where two bodies
///   touch in the same triangles, both copies are dropped.
/// - Triangles that share an edge get the same orientation. Pieces that are visible from straight above show
///   their front there: a surface wholly inside out is reversed, too.
/// - A hidden piece whose triangles agree stays, a buried cavity included, unless it is a closed body inside
///   out in gas. Others take the orientation of two thirds of their area; without such a majority closed
///   pieces face outwards and open ones upwards.
/// Triangles keep their order; those of lids follow.
/// \pre coordinates are finite and indices name vertices.
/// \throws GeometryError with the place of a one-sided surface or of a piece that shows front and back, or if
///         all triangles have collapsed; where openings are closed, also for one of over a quarter of the
///         area around it and for edges of 3, 5, 7... triangles.
/// \note O(n log n).
Repairs repair(TriangleMesh& mesh, const RepairOptions& options = {});

/// Summary of the repairs in one line for the user; empty if there were none.
std::string repair_summary(const Repairs& repairs);

}  // namespace sidewall::surface
