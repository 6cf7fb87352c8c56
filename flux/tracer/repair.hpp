#pragma once
#include <cstddef>

#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// The repairs that repair() made.
struct Repairs {
    std::size_t unused = 0;    ///< vertices that no triangle names, dropped
    std::size_t welded = 0;    ///< vertices merged into another of the same position
    std::size_t repeated = 0;  ///< triangles of the same three vertices as one before, dropped
    std::size_t turned = 0;    ///< triangles whose vertex order was reversed
};

/// Repairs meshes of other programs so that they can be traced, where only one repair is right.
///
/// Vertices of the very same position become one, if edges pair up by it: some formats list every triangle's
/// own. Vertices without triangle go, and so does a triangle that is listed again, either way round: the first
/// one stays. Triangles that share an edge get the same orientation, and every piece of the surface that the source
/// sees shows it its front: a surface wholly inside out is turned over, too. What is hidden from straight
/// above, e.g. a buried cavity, stays as it is if it agrees in itself; else it takes the orientation of two
/// thirds of its area, or, where no such majority is, outwards for a closed piece and upwards for an open
/// one. Triangles keep their order.
/// \throws GeometryError for a one-sided surface, for a piece that shows front and back, and as
///         require_traceable.
/// \note O(n log n).
Repairs repair(TriangleMesh& mesh);

}  // namespace sidewall::flux
