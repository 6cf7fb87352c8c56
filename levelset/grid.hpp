#pragma once
#include <array>
#include <functional>

#include "levelset/domain.hpp"
#include "levelset/narrow_band.hpp"
#include "surface/extraction/marching_cubes.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// Starts OpenVDB; call before the first grid, any number of times.
void initialize();

/// An empty grid with the domain's spacing and world frame.
GridPtr make_grid(const Domain& domain);

/// A grid of the narrow band of \p distance, a signed distance or a bound of it (world units, 1-Lipschitz)
/// given at world points, for \p z_min <= z <= z_max. Evaluates in parallel and skips regions far from the
/// front. A node within 1e-6 dx of the front gets 0 and counts as outside: its sign would be one of rounding.
GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance, double z_min,
                    double z_max);

/// Returns a distance function for the points within \p radius of \p centre. It may leave out bodies that are
/// too far away to matter there.
using DistanceNear = std::function<std::function<double(const Vec3&)>(const Vec3& centre, double radius)>;

/// Says whether leaves are wanted in a column of leaves (8 nodes wide), by its number along x and y.
using LeafChoice = std::function<bool(int x, int y)>;

/// Like sample_grid above: \p distance shows where the band is, \p near gives the nodes' values.
/// \param stop   polled often, by any thread; true ends the work
/// \param where  the columns that are made; null: all.
/// \throws Interrupted if \p stop said so.
GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance,
                    const DistanceNear& near, double z_min, double z_max, const std::function<bool()>& stop,
                    const LeafChoice& where = {});

/// Signed distance at a world point within the lateral box, trilinear, ghosts and far regions included.
double distance_at(const Grid& grid, const Domain& domain, const Vec3& point);

/// Lowest and highest z (world) that the narrow band touches.
/// \throws NumericsError if the grid is empty.
std::array<double, 2> band_z_range(const Grid& grid, const Domain& domain);

/// Deactivates voxels outside the band or the domain, restores the background in them, and drops empty
/// leaves.
void trim_band(Grid& grid, const Domain& domain);

/// Vertex attribute of extracted meshes: the EdgeKind of vertices on edges, 0 of others. Meshes without edges
/// have none.
inline constexpr const char* kEdgeAttribute = "edge";
/// Extends this attribute to all vertices of \p mesh: the kinds of \p sharp, and 0 for the other new ones.
void add_edges(const surface::SharpVertices& sharp, TriangleMesh& mesh);

/// The front of \p grid as a mesh that ends exactly on the domain's sides
/// (surface/extraction/marching_cubes.hpp), periodic sides included; empty if there is no front.
TriangleMesh extract_surface(const Grid& grid, const Domain& domain,
                             surface::SharpEdges edges = surface::SharpEdges::none);

}  // namespace sidewall::levelset
