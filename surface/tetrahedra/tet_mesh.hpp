#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall {

/// Four vertex indices; the fourth lies on the side to which the normal of the first three points.
using Tetrahedron = std::array<std::uint32_t, 4>;

/// Tetrahedra on plain arrays, and the triangles between their regions and on their outside. World units.
struct TetMesh {
    std::vector<Vec3> vertices;
    std::vector<Tetrahedron> tetrahedra;
    std::vector<int> region;              ///< by tetrahedron
    std::vector<std::string> regions;     ///< names by region
    std::vector<Triangle> triangles;      ///< faces of the tetrahedra
    std::vector<int> boundary;            ///< by triangle
    std::vector<std::string> boundaries;  ///< names by boundary
};

/// Triangles in the plane of x and y, and the edges between their regions and on their outside.
struct PlaneMesh {
    std::vector<Vec3> vertices;
    std::vector<Triangle> triangles;
    std::vector<int> region;                          ///< by triangle
    std::vector<std::string> regions;                 ///< names by region
    std::vector<std::array<std::uint32_t, 2>> edges;  ///< edges of the triangles
    std::vector<int> boundary;                        ///< by edge
    std::vector<std::string> boundaries;              ///< names by boundary
};

/// Signed volume of a tetrahedron, positive if \p d lies on the side to which the normal of a, b, c points.
double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Cosine of the smallest dihedral angle of a tetrahedron; 2 unless its volume is positive.
double smallest_dihedral_cosine(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// A face of a tetrahedron; the normal of `corners` points out of it.
struct TetFace {
    Triangle sorted, corners;
    int region;  ///< region of the tetrahedron
};

/// Faces of all tetrahedra whose region is not negative, sorted by `sorted`, then by region: the two copies
/// of a face between neighbours are adjacent.
std::vector<TetFace> sorted_faces(const std::vector<Tetrahedron>& tetrahedra,
                                  const std::function<int(std::uint32_t)>& region_of);

/// Quality of a tetrahedral mesh.
struct TetQuality {
    std::size_t inverted = 0;         ///< tetrahedra without a positive volume
    double least_dihedral_deg = 0.0;  ///< smallest dihedral angle of all
    double mean_least_dihedral_deg = 0.0;
    double longest_edge = 0.0, shortest_edge = 0.0;
    std::vector<double> volume;      ///< by region
    std::vector<std::size_t> count;  ///< by region
};

TetQuality measure_tets(const TetMesh& mesh);

}  // namespace sidewall
