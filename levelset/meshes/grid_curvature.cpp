#include "levelset/meshes/grid_curvature.hpp"

#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <vector>

#include "levelset/openvdb_grid.hpp"

namespace sidewall::levelset {
namespace {

struct NodeCurvature {
    double mean = 0.0, gaussian = 0.0;
};

// First and second derivatives by central differences, per cell (not divided by dx).
struct Derivatives {
    Vec3 gradient;
    Eigen::Matrix3d hessian;
};

Derivatives derivatives(const Grid::ConstUnsafeAccessor& grid, const Domain& domain,
                        const openvdb::Coord& c) {
    const auto value = [&](int x, int y, int z) {
        return static_cast<double>(grid.getValue(
            openvdb::Coord(domain.source_node(0, c.x() + x), domain.source_node(1, c.y() + y), c.z() + z)));
    };
    constexpr int kUnit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const double centre = value(0, 0, 0);
    Derivatives d;
    for (int a = 0; a < 3; ++a) {
        const auto* u = kUnit[a];
        const double low = value(-u[0], -u[1], -u[2]), high = value(u[0], u[1], u[2]);
        d.gradient[a] = 0.5 * (high - low);
        d.hessian(a, a) = high - 2.0 * centre + low;
        for (int b = 0; b < a; ++b) {
            const auto* w = kUnit[b];
            const auto diagonal = [&](int s, int t) {
                return value(s * u[0] + t * w[0], s * u[1] + t * w[1], s * u[2] + t * w[2]);
            };
            d.hessian(a, b) = d.hessian(b, a) =
                0.25 * (diagonal(1, 1) - diagonal(1, -1) - diagonal(-1, 1) + diagonal(-1, -1));
        }
    }
    return d;
}

NodeCurvature curvature_of(const Derivatives& d) {
    const double length = d.gradient.norm();
    if (length < 1e-12) return {};
    const Vec3 n = d.gradient / length;
    const Eigen::Matrix3d h = d.hessian / length;
    // 2 H = tr h - n . h n and K = n . adj(h) n: trace and determinant of h in the tangent plane.
    const double normal = n.dot(h * n);
    Eigen::Matrix3d adjugate;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const int a = (j + 1) % 3, b = (j + 2) % 3, p = (i + 1) % 3, q = (i + 2) % 3;
            adjugate(i, j) = h(a, p) * h(b, q) - h(a, q) * h(b, p);
        }
    return {0.5 * (h.trace() - normal), n.dot(adjugate * n)};
}

}  // namespace

surface::Curvature curvature(const Grid& grid, const Domain& domain, const TriangleMesh& mesh) {
    surface::Curvature result{std::vector<double>(mesh.vertices.size()),
                              std::vector<double>(mesh.vertices.size())};
    const double dx = domain.spacing;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.vertices.size(), 256), [&](const auto& range) {
        const auto accessor = grid.getConstUnsafeAccessor();
        for (std::size_t v = range.begin(); v != range.end(); ++v) {
            const Vec3 index = domain.to_index(mesh.vertices[v]);
            const auto [low, axis] = edge_at(index);
            openvdb::Coord high = low;
            ++high[axis];
            const double t = index[axis] - low[axis];
            const auto at = [&](const openvdb::Coord& c) {
                Derivatives d = derivatives(accessor, domain, c);
                d.gradient /= dx;
                d.hessian /= dx * dx;
                return curvature_of(d);
            };
            const NodeCurvature a = at(low), b = at(high);
            result.mean[v] = (1.0 - t) * a.mean + t * b.mean;
            result.gaussian[v] = (1.0 - t) * a.gaussian + t * b.gaussian;
        }
    });
    return result;
}

}  // namespace sidewall::levelset
