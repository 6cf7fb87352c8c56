#pragma once
#include <array>
#include <functional>
#include <memory>

#include "levelset/domain.hpp"
#include "surface/extraction/float_grid.hpp"

namespace sidewall::levelset {

/// Signed distance, world units, negative inside. Active voxels are the narrow band |phi| < kHalfWidth dx; an
/// inactive voxel of an existing leaf holds exactly the background, +-kHalfWidth dx. Only the domain's own
/// nodes are active, and nothing is ever read from tiles: see inside(). Declared only: whoever reads voxels
/// includes levelset/openvdb_grid.hpp.
using Grid = surface::FloatGrid;
using GridPtr = std::shared_ptr<Grid>;

/// Half-width of the narrow band in grid spacings: a WENO5 stencil about a voxel at the front fits into it,
/// and so does the Hessian at a node of a cut cell.
inline constexpr double kHalfWidth = 3.0;

/// Starts OpenVDB; call before the first grid, any number of times.
void initialize();

/// An empty grid with the domain's spacing and world frame.
GridPtr make_grid(const Domain& domain);

/// A grid of the narrow band of \p distance, a signed distance or a bound of it (world units, 1-Lipschitz)
/// given at world points, for \p z_min <= z <= z_max. Evaluates in parallel and skips regions far from the
/// front.
GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance, double z_min,
                    double z_max);

/// Signed distance at a world point within the lateral box, trilinear, ghosts and far regions included.
double distance_at(const Grid& grid, const Domain& domain, const Vec3& point);

/// Lowest and highest z (world) that the narrow band touches.
/// \throws NumericsError if the grid is empty.
std::array<double, 2> band_z_range(const Grid& grid, const Domain& domain);

/// Deactivates voxels outside the band or the domain, restores the background in them, and drops empty
/// leaves.
void trim_band(Grid& grid, const Domain& domain);

}  // namespace sidewall::levelset
