#pragma once
#include <cstdint>

#include "levelset/grid.hpp"
#include "surface/curvature.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

enum class CurvatureFormula : std::uint8_t {
    general,        ///< of any level set function; the reference
    shape_operator  ///< half the trace of the Hessian: right for a true distance, and faster
};

/// Curvatures at the vertices of the mesh that extract_surface() made of \p grid: at both grid nodes of a
/// vertex's edge by central differences, then linear along the edge. Goldman, Comput. Aided Geom. Des. 22
/// (2005) 632, equations 3.4 and 4.1 (general); Lenz (2023), section 3.3.
/// \note Parallel. Ghost nodes are read through the domain's sides.
surface::Curvature curvature(const Grid& grid, const Domain& domain, const TriangleMesh& mesh,
                             CurvatureFormula formula = CurvatureFormula::general);

}  // namespace sidewall::levelset
