#pragma once
#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The front of \p grid as a mesh that ends exactly on the domain's sides (surface/extraction/marching_cubes.hpp),
/// periodic sides included; empty if there is no front.
TriangleMesh extract_surface(const Grid& grid, const Domain& domain);

/// The front of layer \p layer of a stack. Where levels meet, the cells of the coarser one take the vertices that the
/// finer one has on their common faces, on which its values are those of the coarser one, interpolated: the mesh is
/// watertight and manifold (edge trees: Kazhdan, Klein, Dalal, Hoppe, Eurographics Symp. Geom. Proc. 2007).
TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer);
/// The same of the wafer's surface.
TriangleMesh extract_surface(const MaterialStack& stack);

/// Of the front of layer \p layer at least what \p plane meets: its cut is the whole front's. A small part of the whole
/// if the plane is across x or y; some vertices may be of no triangle.
TriangleMesh extract_around(const MaterialStack& stack, std::size_t layer, const surface::Plane& plane);

}  // namespace sidewall::levelset
