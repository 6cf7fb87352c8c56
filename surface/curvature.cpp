#include "surface/curvature.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "surface/error.hpp"
#include "surface/quality.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

/// What one triangle adds at one of its corners.
struct Corner {
    double angle = 0.0;
    double area = 0.0;              ///< mixed Voronoi area, Meyer et al. 2003, figure 4
    double laplacian_size = 0.0;    ///< sum of the Laplacian terms' lengths, for its rounding error
    Vec3 laplacian = Vec3::Zero();  ///< half the sum of cot(alpha) (x_i - x_j) over the corner's two edges
    Vec3 normal = Vec3::Zero();     ///< unit normal times the angle
};

std::array<Corner, 3> triangle_corners(const TriangleMesh& mesh, std::size_t t) {
    std::array<Corner, 3> corners;
    const Triangle& triangle = mesh.triangles[t];
    const std::array p = {mesh.vertices[triangle[0]], mesh.vertices[triangle[1]], mesh.vertices[triangle[2]]};
    const Vec3 twice = area_vector(mesh, t);
    const double area = 0.5 * twice.norm();
    if (!(area > 0.0)) return corners;
    const auto angles = inner_angles(p[0], p[1], p[2]);
    const bool obtuse = *std::max_element(angles.begin(), angles.end()) > std::numbers::pi / 2.0;
    std::array<double, 3> cotangent;
    for (std::size_t k = 0; k < 3; ++k)
        cotangent[k] = (p[(k + 1) % 3] - p[k]).dot(p[(k + 2) % 3] - p[k]) / (2.0 * area);
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
        Corner& corner = corners[k];
        corner.angle = angles[k];
        corner.normal = angles[k] * twice / (2.0 * area);
        corner.laplacian = 0.5 * (cotangent[j] * (p[k] - p[i]) + cotangent[i] * (p[k] - p[j]));
        corner.laplacian_size =
            std::abs(cotangent[j]) * (p[k] - p[i]).norm() + std::abs(cotangent[i]) * (p[k] - p[j]).norm();
        if (obtuse)
            corner.area = angles[k] > std::numbers::pi / 2.0 ? area / 2.0 : area / 4.0;
        else
            corner.area =
                (cotangent[j] * (p[k] - p[i]).squaredNorm() + cotangent[i] * (p[k] - p[j]).squaredNorm()) /
                8.0;
    }
    return corners;
}

/// How a vertex's ring of triangles is completed: not at all, by mirroring at a side, or impossible (`open`).
struct Rim {
    std::uint8_t mirror_x = 0, mirror_y = 0, open = 0;
};

std::vector<Rim> rims(const TriangleMesh& mesh) {
    std::vector<Rim> rim(mesh.vertices.size());
    const Box3 box = bounding_box(mesh);
    const EdgeTable table = edge_table(mesh);
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        if (table.corners[e].size() > 1) continue;
        const Vec3 &p = mesh.vertices[table.edges[e][0]], &q = mesh.vertices[table.edges[e][1]];
        const auto in_side = [&](int axis) {
            return p[axis] == q[axis] && (p[axis] == box.min[axis] || p[axis] == box.max[axis]);
        };
        const bool x = in_side(0), y = in_side(1);
        for (const std::uint32_t v : table.edges[e]) {
            rim[v].mirror_x |= x;
            rim[v].mirror_y |= y;
            rim[v].open |= !x && !y;
        }
    }
    return rim;
}

}  // namespace

Curvature mesh_curvature(const TriangleMesh& mesh) {
    const std::size_t n = mesh.vertices.size();
    std::vector<std::array<Corner, 3>> corners(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, corners.size(),
                      [&](std::size_t t) { corners[t] = triangle_corners(mesh, t); });
    const Rows around = vertex_corners(mesh);
    const std::vector<Rim> rim = rims(mesh);

    Curvature result{std::vector<double>(n, 0.0), std::vector<double>(n, 0.0)};
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t v) {
        if (rim[v].open) return;
        Corner sum;
        for (const std::uint32_t c : around[v]) {
            const Corner& corner = corners[c / 3][c % 3];
            sum.angle += corner.angle;
            sum.area += corner.area;
            sum.laplacian_size += corner.laplacian_size;
            sum.laplacian += corner.laplacian;
            sum.normal += corner.normal;
        }
        if (!(sum.area > 0.0)) return;
        // A mirror image at a side plane cancels components normal to it and doubles all else, area too.
        double copies = 1.0;
        if (rim[v].mirror_x) sum.laplacian.x() = sum.normal.x() = 0.0, copies *= 2.0;
        if (rim[v].mirror_y) sum.laplacian.y() = sum.normal.y() = 0.0, copies *= 2.0;
        // Sums below this (radians; relative for the Laplacian) are rounding errors of a flat surface.
        constexpr double kRounding = 1e-12;
        const double deficit = 2.0 * std::numbers::pi - copies * sum.angle;
        if (std::abs(deficit) > kRounding) result.gaussian[v] = deficit / (copies * sum.area);
        const double along = sum.laplacian.dot(sum.normal.normalized());
        if (std::abs(along) > kRounding * sum.laplacian_size) result.mean[v] = along / (2.0 * sum.area);
    });

    const Curvature inner = result;
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t v) {
        if (!rim[v].open) return;
        double mean = 0.0, gaussian = 0.0;
        int count = 0;
        for (const std::uint32_t c : around[v])
            for (std::uint32_t k = 1; k < 3; ++k) {
                const std::uint32_t neighbour = mesh.triangles[c / 3][(c % 3 + k) % 3];
                if (rim[neighbour].open) continue;
                mean += inner.mean[neighbour];
                gaussian += inner.gaussian[neighbour];
                ++count;
            }
        if (count == 0) return;
        result.mean[v] = mean / count;
        result.gaussian[v] = gaussian / count;
    });
    return result;
}

double auto_feature_parameter(std::span<const double> mean, std::span<const double> gaussian,
                              double spacing) {
    constexpr double kMost = 0.5, kLeast = 0.02, kMedians = 3.0, kShare = 0.05;
    std::vector<double> size(mean.size());
    for (std::size_t i = 0; i < size.size(); ++i)
        size[i] = spacing * std::max(std::abs(mean[i]), std::sqrt(std::abs(gaussian[i])));
    if (size.empty()) return kMost;
    const auto quantile = [&](double share) {
        const auto at =
            size.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(size.size() - 1));
        std::nth_element(size.begin(), at, size.end());
        return *at;
    };
    const double floor = std::max(kLeast, kMedians * quantile(0.5));
    return std::min(kMost, std::max(floor, quantile(1.0 - kShare)));
}

std::vector<std::uint8_t> feature_flags(const Curvature& curvature, double spacing,
                                        double feature_parameter) {
    if (!(spacing > 0.0) || !std::isfinite(spacing))
        throw GeometryError("grid spacing {}: must be a positive length", spacing);
    if (!(feature_parameter > 0.0) || !std::isfinite(feature_parameter))
        throw GeometryError("feature parameter {}: must be positive", feature_parameter);
    const double limit = feature_parameter / spacing;
    std::vector<std::uint8_t> flags(curvature.mean.size());
    for (std::size_t i = 0; i < flags.size(); ++i)
        flags[i] = std::abs(curvature.mean[i]) > limit || std::abs(curvature.gaussian[i]) > limit * limit;
    return flags;
}

std::vector<std::uint8_t> feature_flags(const TriangleMesh& mesh, double spacing, double feature_parameter) {
    return feature_flags(mesh_curvature(mesh), spacing, feature_parameter);
}

}  // namespace sidewall::surface
