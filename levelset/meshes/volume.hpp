#pragma once
#include <cstddef>
#include <vector>

#include "levelset/layers/stack.hpp"
#include "levelset/meshes/pieces.hpp"

namespace sidewall::levelset {

/// Volume of all material between z = 0 and the front of a layer, negative where the front lies below z = 0.
/// In an axial domain it is the volume of the revolution.
/// The mesh's triangles are chords of the curved front, which lies up to dx^2 / (8 r) beyond them (r: radius
/// of curvature). The integral of the grid's distance over the triangles is therefore added; this distance is
/// cubic along cell edges, so the volume is of fourth order in dx. Nothing is added at edges of the mesh and
/// where a second difference exceeds half a cell: between planes the mesh is exact.
/// \note For a wafer of several levels (layers/levels.hpp) it is the mesh's volume.
double volume_of(const MaterialStack& stack, std::size_t layer);

/// The pieces of the wafer's surface, the volumes of closed ones up to the front, as in volume_of.
/// \param surface  extract_surface of the top layer.
std::vector<SurfacePiece> surface_pieces(const TriangleMesh& surface, const MaterialStack& stack);

}  // namespace sidewall::levelset
