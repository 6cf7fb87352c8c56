#pragma once
#include "surface/extraction/cut_leaves.hpp"

namespace sidewall::surface {

/// Adds vertices on the edges and corners of the surface to a mesh of marching cubes: extended marching cubes
/// (Kobbelt, Botsch, Schwanecke and Seidel, SIGGRAPH 2001) from the grid's values alone. A cell with
/// crossings whose planes are over 37 degrees apart gets a vertex where these planes meet, and a fan of
/// triangles from there to its crossings. The vertices of two such neighbours are joined. Crossings of fans,
/// and those on an edge of the surface, move along their grid edges; all else stays the same to the bit.
///
/// The vertex of a fan lies in its cell, or in a cell beside it that the surface does not cut and that no
/// other fan takes. A fan from there to a loop on the cell's faces cuts neither itself nor another one: no
/// triangles intersect. Cells through which the surface passes twice get no fan.
///
/// \param mesh  marching cubes of the leaves.
SharpVertices add_sharp_edges(const CutLeaves& leaves, const LateralGrid& box, SharpEdges which,
                              TriangleMesh& mesh);

}  // namespace sidewall::surface
