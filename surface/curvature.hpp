#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "surface/triangle_mesh.hpp"

namespace sidewall::surface {

/// Curvatures per vertex. A sphere of radius r with normals outwards has mean 1/r and gaussian 1/r^2.
struct Curvature {
    std::vector<double> mean;      ///< 1 / length unit; positive where the material is convex
    std::vector<double> gaussian;  ///< 1 / length unit squared
};

/// Discrete curvatures of a mesh: cotangent Laplacian and angle deficit over mixed Voronoi areas. Meyer,
/// Desbrun, Schroeder, Barr: Discrete differential-geometry operators for triangulated 2-manifolds (2003),
/// eqs. 8 to 10. The Laplacian is projected onto the vertex normal. Exactly zero where the surface is flat to
/// rounding.
///
/// A boundary vertex whose boundary edges lie in side planes of the mesh's bounding box (x or y = min or max)
/// is treated as if the surface were mirrored there; any other boundary vertex takes the average of its inner
/// neighbours, or zero. Vertices without a triangle of positive area get zero.
///
/// \note O(n), parallel, deterministic. At vertices of valence other than six the gaussian curvature
/// converges on
///       average, not pointwise.
Curvature mesh_curvature(const TriangleMesh& mesh);

/// A feature parameter C from the distribution of curvature, in place of the fixed 0.5, which flags next to
/// nothing where corners are rounded over several cells: the one that flags the 5 % most curved vertices, but
/// no less than three times the median curvature (roughness, or walls that are curved all over, are no
/// features), no less than 0.02 and no more than 0.5. Curvature stands for the greater of |mean| and
/// sqrt(|gaussian|), times the spacing. 0.5 for no vertices.
double auto_feature_parameter(std::span<const double> mean, std::span<const double> gaussian, double spacing);

/// One flag a vertex: |mean| > feature_parameter / spacing or |gaussian| > (feature_parameter / spacing)^2
/// (Lenz 2023, section 8.2.1).
///
/// \throws GeometryError unless spacing and feature_parameter are positive and finite.
std::vector<std::uint8_t> feature_flags(const Curvature& curvature, double spacing,
                                        double feature_parameter = 0.5);
std::vector<std::uint8_t> feature_flags(const TriangleMesh& mesh, double spacing,
                                        double feature_parameter = 0.5);

}  // namespace sidewall::surface
