#pragma once
#include <array>
#include <functional>

#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// Extracts the front of layer \p layer of a stack as a mesh. Where two levels meet, cells of the coarser
/// level use the vertices of the finer level on their common faces. There the finer level's values are
/// interpolated from the coarser level, so that the mesh is watertight and manifold (edge trees: Kazhdan,
/// Klein, Dalal, Hoppe, Eurographics Symp. Geom. Proc. 2007).
TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer,
                             surface::SharpEdges edges = surface::SharpEdges::all);
/// Gives the sharp edges that a cell of a level may have at most, by the cell's low corner.
using EdgesIn =
    std::function<surface::SharpEdges(const MaterialStack& level, const std::array<int, 3>& cell)>;
/// Extracts the front of layer \p layer with the sharp edges that \p edges_in allows each cell.
TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer, const EdgesIn& edges_in);
/// The wafer's surface: the front of the uppermost layer.
TriangleMesh extract_surface(const MaterialStack& stack,
                             surface::SharpEdges edges = surface::SharpEdges::all);

/// Extracts a part of the front of layer \p layer that has the same cut with \p plane as the whole front. The
/// part is small if the plane is across x or y. Some vertices may belong to no triangle.
TriangleMesh extract_around(const MaterialStack& stack, std::size_t layer, const surface::Plane& plane);

}  // namespace sidewall::levelset
