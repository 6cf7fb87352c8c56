#pragma once
#include <vector>

#include "surface/triangle_mesh.hpp"

// Round holes as a level set gives them, and the table of exact fluxes in a cylinder,
// tests/assets/cylinder_radiosity.csv.
namespace sidewall::flux {

/// A row of the table; depth relative, -1: the mean over the floor.
struct CylinderRow {
    double aspect, sticking, depth, flux;
};

std::vector<CylinderRow> cylinder_rows();

/// A quarter of a round hole of radius 1, its axis on an edge of the box [0, 2] x [0, 2], extracted by marching
/// cubes from a grid of \p cells cells a radius and simplified by `region-bounded` unless \p raw.
TriangleMesh extracted_hole(double depth, int cells, bool raw = false);

/// Flux over a tenth of the depth, from triangles around its middle: the geometric mean, so that what falls
/// steeply is as at the middle. \p tenth 10: the floor's mean.
double tenth_mean(const TriangleMesh& mesh, const std::vector<double>& triangle_flux, double depth,
                  int tenth);

/// Area-weighted rms of flux / truth - 1 over the triangles of a tenth or the floor.
double tenth_rms(const TriangleMesh& mesh, const std::vector<double>& triangle_flux,
                 const std::vector<double>& truth, double depth, int tenth);

}  // namespace sidewall::flux
