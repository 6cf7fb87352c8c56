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
/// eqs. 8 to 10. The Laplacian is projected onto the vertex normal. Curvatures of surfaces that are flat to
/// rounding are exactly zero.
///
/// A boundary vertex whose boundary edges lie in side planes of the mesh's bounding box (x or y = min or max)
/// is treated as if the surface were mirrored there; any other boundary vertex takes the average of its inner
/// neighbours, or zero. Vertices without a triangle of positive area get zero.
///
/// \note O(n), parallel, deterministic. At vertices of valence other than six the gaussian curvature
///       converges on average, not pointwise.
Curvature mesh_curvature(const TriangleMesh& mesh);

/// Feature parameter C for feature_flags(), chosen from the distribution of curvature. The fixed default 0.5
/// flags almost nothing where corners are rounded over several cells. The chosen C flags the 5 % most curved
/// vertices, but is at least three times the median curvature (roughness, and walls that are curved
/// everywhere, are no features), at least 0.02 and at most 0.5. Curvature means max(|mean|, sqrt(|gaussian|))
/// times the spacing. Without vertices C is 0.5.
double auto_feature_parameter(std::span<const double> mean, std::span<const double> gaussian, double spacing);

/// Feature flag of each vertex: 1 where |mean| > feature_parameter / spacing or |gaussian| >
/// (feature_parameter / spacing)^2 (Lenz 2023, section 8.2.1).
///
/// \throws GeometryError unless spacing and feature_parameter are positive and finite.
std::vector<std::uint8_t> feature_flags(const Curvature& curvature, double spacing,
                                        double feature_parameter = 0.5);
std::vector<std::uint8_t> feature_flags(const TriangleMesh& mesh, double spacing,
                                        double feature_parameter = 0.5);

}  // namespace sidewall::surface
