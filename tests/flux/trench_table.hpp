#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"
#include "tests/flux/truth.hpp"

// The table of exact fluxes in an infinite trench, tests/assets/trench_radiosity.csv, and the triangles of a
// mesh to which its rows refer.
namespace sidewall::flux {

/// A row of the table of exact fluxes in an infinite trench; position -1: the mean over wall or floor.
struct Row {
    double aspect, sticking, position, flux;
    std::string where;
};

std::vector<Row> radiosity_rows();

/// Half the width of the strip around a position of the table, relative to depth or width. Strips are as wide
/// as they can be without touching, because few rays reach the deep ones.
double half_width(double position);

/// Relative positions at which those strips end, without 0 and 1.
inline const std::vector<double> kCuts{0.05, 0.15, 0.35, 0.4, 0.6, 0.65, 0.85, 0.95};

/// Triangles of a trench of width 1, extruded or extracted, to which a row refers; by symmetry they are on
/// both walls and both halves of the floor.
std::vector<std::size_t> triangles_of(const TriangleMesh& mesh, const Row& row);

/// Mean of the exact flux over a row's strip, by quadrature.
double exact_mean(const TrenchFlux& exact, const Row& row);

}  // namespace sidewall::flux
