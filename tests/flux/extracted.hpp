#pragma once
#include <array>
#include <functional>

#include "surface/triangle_mesh.hpp"

// Trenches and holes extracted by marching cubes from a grid of values, as from a level set.
namespace sidewall::flux {

/// The zero level of \p phi over cells[0] x cells[1] cells from node \p first on, layers \p low to \p high;
/// node k lies at k dx.
TriangleMesh extract(std::array<int, 2> first, std::array<int, 2> cells, int low, int high, double dx,
                     const std::function<double(double, double, double)>& phi);

/// A trench of width 1 along y in the box [-0.6, 0.6] x [0, 0.8], from a grid of 20 cells a width.
TriangleMesh extracted_trench(double depth);

/// A round hole of radius 1 around z. Its level set is no distance, but its zeros along the edges of a grid
/// of spacing \p dx are those of a sharp rim and a sharp foot, which are cut by 0.01 cells only.
std::function<double(double, double, double)> sharp_hole(double depth, double dx);

/// A quarter of that hole, its axis on an edge of the box [0, 2] x [0, 2], from a grid of
/// \p cells cells a radius.
TriangleMesh extracted_hole(double depth, int cells);

/// A mesh extracted at spacing \p dx, simplified by `region-bounded`.
TriangleMesh simplified(const TriangleMesh& mesh, double dx);

}  // namespace sidewall::flux
