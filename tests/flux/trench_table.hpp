#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"
#include "tests/flux/truth.hpp"

// The table of exact fluxes in an infinite trench, tests/assets/trench_radiosity.csv, and where on a mesh its
// rows are.
namespace sidewall::flux {

/// A row of the table of exact fluxes in an infinite trench; position -1: the mean over wall or floor.
struct Row {
    double aspect, sticking, position, flux;
    std::string where;
};

std::vector<Row> radiosity_rows();

/// Half the width of the strip around a position of the table, as wide as strips may be without touching: few
/// rays reach the deep ones. Relative to depth and width.
double half_width(double position);

/// Where those strips end, but for 0 and 1.
inline const std::vector<double> kCuts{0.05, 0.15, 0.35, 0.4, 0.6, 0.65, 0.85, 0.95};

/// Triangles of a trench of width 1, extruded or extracted, that a row speaks of; by symmetry, of both walls and both halves of the
/// floor.
std::vector<std::size_t> triangles_of(const TriangleMesh& mesh, const Row& row);

/// The mean over a row's strip, from the quadrature.
double exact_mean(const TrenchFlux& exact, const Row& row);

}  // namespace sidewall::flux
