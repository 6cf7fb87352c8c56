#pragma once
#include "surface/repair.hpp"

namespace sidewall::surface {

/// Orients all triangles so that their fronts face the gas, and closes openings where the options ask for it.
/// This is the last stage of repair(), which documents the rules. Records the changes in \p done.
/// \throws GeometryError as repair().
void orient(TriangleMesh& mesh, const RepairOptions& options, Repairs& done);

}  // namespace sidewall::surface
