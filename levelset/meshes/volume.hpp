#pragma once
#include <cstddef>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// Volume of the material of a layer and those below over z = 0, negative below it; of an axial domain that of the revolution.
/// Triangles of the front's mesh are chords of a curved front, which lies up to dx^2 / (8 r) beyond them. To their volume
/// comes the integral of the grid's distance over them, cubic along the edges of cells: of fourth order in dx. At edges of
/// the mesh and where second differences are over half a cell it is the mesh's alone, which is exact between planes.
/// \note A wafer of several levels (layers/levels.hpp) has its mesh's volume.
double volume_of(const MaterialStack& stack, std::size_t layer);

}  // namespace sidewall::levelset
