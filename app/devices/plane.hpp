#pragma once
#include "surface/tetrahedra/tet_mesh.hpp"

namespace sidewall::app {

/// The triangles in which the tetrahedra of a profile, a wafer that is the same at all y, meet its side of least y: x and
/// height become x and y of the plane. Regions and boundaries keep their names; edges between materials and gas are
/// `surface`, others between materials as in `Si/SiO2`.
/// \param mesh  with its boundaries, as make_device makes it.
PlaneMesh plane_of(const TetMesh& mesh);

}  // namespace sidewall::app
