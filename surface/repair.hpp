#pragma once
#include <cstddef>
#include <functional>
#include <string>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// The repairs that repair() made.
struct Repairs {
    std::size_t triangles = 0;  ///< of the mesh afterwards, without lids
    std::size_t unused = 0;     ///< vertices that no triangle names, dropped
    std::size_t welded = 0;     ///< vertices merged into another of the same position
    std::size_t nearby = 0;     ///< vertices merged into another within `reach`
    double reach = 0.0;         ///< how far rounding may put them apart; 0 where no edge is open
    std::size_t collapsed = 0;  ///< triangles with two corners in one vertex, dropped
    std::size_t repeated = 0;   ///< triangles of the same three vertices as another, dropped
    std::size_t turned = 0;     ///< triangles whose vertex order was reversed
    std::size_t closed = 0;     ///< openings that got a lid
};

/// How far repair() goes.
struct RepairOptions {
    /// Whether pieces turn their front to the gas; else only the triangles of a piece agree.
    bool face_gas = true;
    /// Whether an opening within these bounds should be closed; attributes are lost then. Empty: none is.
    std::function<bool(const Box3&)> closes = {};
};

/// Repairs meshes of other programs so that they tell gas from material, where only one repair is right.
///
/// Vertices of the very same position become one, if edges pair up by it: some formats list every triangle's own. Where
/// edges are left open, so do those at them that are within 1e-5 of the mesh's diagonal and a tenth of its median edge,
/// as rounding puts them apart; corners of one triangle never do. Vertices without triangle go, and so does a triangle
/// that is listed again: the first one stays. Where two bodies touch in the same triangles, these cancel. Triangles
/// that share an edge get the same orientation, and every piece of the surface that the source sees shows it its front:
/// a surface wholly inside out is turned over, too. What is hidden from straight above stays as it is if it agrees in
/// itself, but for a closed body inside out that lies in gas; a buried cavity stays. Else it takes the orientation of
/// two thirds of its area, or, where no such majority is, outwards for a closed piece and upwards for an open one.
/// Triangles keep their order; those of lids follow.
/// \pre coordinates are finite and indices name vertices.
/// \throws GeometryError with the place of a one-sided surface and of a piece that shows front and back; where openings are
///         closed also of one of over a quarter of the area around it, and of an edge of three triangles.
/// \note O(n log n).
Repairs repair(TriangleMesh& mesh, const RepairOptions& options = {});

/// What was repaired, in a line for the mesh's user; "" if nothing was.
std::string words_on(const Repairs& repairs);

}  // namespace sidewall::surface
