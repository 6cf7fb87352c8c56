#pragma once
#include <cstdint>
#include <vector>

#include "levelset/domain.hpp"
#include "levelset/meshes/pieces.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The triangles of the wafer's surface that bound gas cut off from the gas above it, as in a keyhole that
/// deposition has closed.
/// \param surface  extract_surface of the top layer.
/// \param pieces   its surface_pieces.
/// \returns one flag a triangle; empty if no gas is cut off.
/// \note O(1) if no piece shuts gas in, else O(n log n).
std::vector<std::uint8_t> sealed_off(const TriangleMesh& surface, std::vector<SurfacePiece> pieces,
                                     const Domain& domain);

}  // namespace sidewall::levelset
