#pragma once
#include "simplify/simplify.hpp"

namespace sidewall::simplify {

/// Lindstrom-Turk simplification on CGAL's edge collapse: the reference for CollapseEngine. Sequential. Other
/// guarantees: shape is height over longest edge, neither degrees nor errors are bounded, and a vertex may
/// leave the mesh's box where no side plane bounds it.
/// \throws as simplify does.
Result simplify_cgal_lindstrom_turk(const TriangleMesh& mesh, const Options& options);

}  // namespace sidewall::simplify
