#pragma once
#include "simplify/simplify_options.hpp"
#include "simplify/simplify_result.hpp"

namespace sidewall::simplify {

/// simplify_lindstrom_turk on CGAL's edge collapse: the reference that the own engine is measured against. Keeps
/// what CollapseEngine keeps, except that a vertex may leave the mesh's box where no side plane bounds it.
/// \throws as simplify_lindstrom_turk does.
/// \note O(n log n), sequential.
Result simplify_cgal_lindstrom_turk(const TriangleMesh& mesh, const LindstromTurkOptions& options);

}  // namespace sidewall::simplify
