#pragma once
#include <array>
#include <functional>

#include "levelset/grid.hpp"
#include "levelset/layers/stack.hpp"
#include "surface/cut.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The front of layer \p layer of a stack. Where levels meet, the cells of the coarser one take the vertices that the
/// finer one has on their common faces, on which its values are those of the coarser one, interpolated: the mesh is
/// watertight and manifold (edge trees: Kazhdan, Klein, Dalal, Hoppe, Eurographics Symp. Geom. Proc. 2007).
TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer,
                             surface::SharpEdges edges = surface::SharpEdges::all);
/// Says which edges a cell of a level may have at the most, by the cell's low corner.
using EdgesIn =
    std::function<surface::SharpEdges(const MaterialStack& level, const std::array<int, 3>& cell)>;
/// The front of layer \p layer with the edges that its cells may have.
TriangleMesh extract_surface(const MaterialStack& stack, std::size_t layer, const EdgesIn& edges_in);
/// The wafer's surface: the front of the uppermost layer.
TriangleMesh extract_surface(const MaterialStack& stack,
                             surface::SharpEdges edges = surface::SharpEdges::all);

/// A part of the front of layer \p layer that has the same cut with \p plane as the whole. It is small if the plane is
/// across x or y; some vertices may be of no triangle.
TriangleMesh extract_around(const MaterialStack& stack, std::size_t layer, const surface::Plane& plane);

}  // namespace sidewall::levelset
