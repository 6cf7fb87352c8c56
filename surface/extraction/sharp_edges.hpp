#pragma once
#include "surface/extraction/cut_leaves.hpp"

namespace sidewall::surface {

/// Gives a mesh of marching cubes vertices on the edges and corners of the surface: extended marching cubes (Kobbelt, Botsch,
/// Schwanecke and Seidel, SIGGRAPH 2001) from the values of the grid alone. A cell on whose edges the surface has planes over
/// 37 degrees apart gets a vertex where these planes meet, with a fan of triangles to its crossings; between two such cells
/// their vertices are joined. Crossings of fans move along their edges of the grid; all else stays as it is, to the bit.
///
/// The vertex of a fan lies within its own cell, or in a cell beside it that the surface does not cut and that it alone
/// takes. A fan from there to a loop on the cell's faces does not cut itself, nor another cell's: no triangles intersect.
/// Cells through which the surface passes twice get none.
///
/// \param mesh  marching cubes of the leaves.
SharpVertices add_sharp_edges(const CutLeaves& leaves, const LateralGrid& box, SharpEdges which,
                              TriangleMesh& mesh);

}  // namespace sidewall::surface
