#pragma once
#include <vector>

#include "surface/triangle_mesh.hpp"
#include "tests/flux/truth.hpp"

// The table of exact fluxes in a cylinder, tests/assets/cylinder_radiosity.csv, and the triangles of a mesh
// to which its rows refer.
namespace sidewall::flux {

/// A row of the table. `depth` is relative to that of the hole; -1: the mean over the floor.
struct CylinderRow {
    double aspect, sticking, depth, flux;
};

std::vector<CylinderRow> cylinder_rows();

/// Exact flux at a height within a hole, from the rings and annuli of cylinder_flux.
class CylinderTruth {
  public:
    CylinderTruth(double depth, double sticking);
    double wall(double z) const;
    double floor() const { return flux_.floor_mean; }

  private:
    double depth_;
    CylinderFlux flux_;
};

/// Mean flux of the triangles of a tenth of the depth (0 to 9), or of the floor (10), over the exact mean.
double tenth_ratio(const TriangleMesh& mesh, const std::vector<double>& triangle_flux,
                   const CylinderTruth& truth, double depth, int tenth);

/// Area-weighted rms of flux / truth - 1 over the triangles of a tenth or the floor.
double tenth_rms(const TriangleMesh& mesh, const std::vector<double>& triangle_flux,
                 const std::vector<double>& truth, double depth, int tenth);

}  // namespace sidewall::flux
