#pragma once
#include <cstdint>
#include <vector>

#include "levelset/domain.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// The triangles of the wafer's surface that bound gas cut off from the gas above it, as in a keyhole that
/// deposition has closed.
/// \param surface  extract_surface of the top layer: pieces of it that meet at periodic sides are one.
/// \returns one flag a triangle; empty if no gas is cut off.
/// \note O(n) for a surface of one piece, else O(n log n).
std::vector<std::uint8_t> sealed_off(const TriangleMesh& surface, const Domain& domain);

}  // namespace sidewall::levelset
