#pragma once
#include "surface/repair.hpp"

namespace sidewall::surface {

/// Turns triangles over until all show their front to the gas, and closes openings that are to be closed: the second half of
/// repair(), which documents it. Adds to \p done.
/// \throws GeometryError as repair().
void orient(TriangleMesh& mesh, const RepairOptions& options, Repairs& done);

}  // namespace sidewall::surface
