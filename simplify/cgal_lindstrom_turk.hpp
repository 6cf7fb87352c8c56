#pragma once
#include "simplify/simplify.hpp"

namespace sidewall::simplify {

/// Runs simplify_lindstrom_turk's rule on CGAL's edge collapse: the reference that the own engine is measured
/// against. Keeps what CollapseEngine keeps, except that a vertex may leave the mesh's box where no side plane
/// bounds it. Sequential.
/// \throws as simplify does.
Result simplify_cgal_lindstrom_turk(const TriangleMesh& mesh, const Options& options);

}  // namespace sidewall::simplify
