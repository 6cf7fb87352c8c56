#include "surface/distance.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

// Angle-weighted normals: per vertex, the sum of its triangles' normals times their inner angles there.
std::vector<Vec3> vertex_normals(const TriangleMesh& mesh, const std::vector<Vec3>& face) {
    std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& tri = mesh.triangles[t];
            const std::uint32_t a = tri[k], b = tri[(k + 1) % 3], c = tri[(k + 2) % 3];
            const Vec3 u = (mesh.vertices[b] - mesh.vertices[a]).normalized(),
                       v = (mesh.vertices[c] - mesh.vertices[a]).normalized();
            normals[a] += std::acos(std::clamp(u.dot(v), -1.0, 1.0)) * face[t];
        }
    return normals;
}

// Per triangle and edge, the sum of the normals of all triangles at that edge.
std::vector<std::array<Vec3, 3>> edge_normals(const TriangleMesh& mesh, const std::vector<Vec3>& face) {
    const EdgeTable table = edge_table(mesh);
    std::vector<std::array<Vec3, 3>> normals(mesh.triangles.size(),
                                             {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()});
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        Vec3 sum = Vec3::Zero();
        for (const std::uint32_t corner : table.corners[e]) sum += face[corner / 3];
        for (const std::uint32_t corner : table.corners[e]) normals[corner / 3][corner % 3] = sum;
    }
    return normals;
}

// Per vertex, 1 if a triangle uses it; all 1 for a mesh without triangles, which is a set of points.
std::vector<std::uint8_t> on_surface(const TriangleMesh& mesh) {
    std::vector<std::uint8_t> used(mesh.vertices.size(), mesh.triangles.empty() ? 1 : 0);
    for (const Triangle& triangle : mesh.triangles)
        for (const std::uint32_t v : triangle) used[v] = 1;
    return used;
}

}  // namespace

Distance distance(const TriangleMesh& from, const TriangleMesh& to) {
    return distance(from, RayScene(to));
}

Distance distance(const TriangleMesh& from, const RayScene& to) {
    if (from.vertices.empty())
        throw GeometryError("cannot measure a distance from an empty mesh: it has no vertex");
    const std::size_t n = from.vertices.size();
    Distance result;
    result.per_vertex.assign(n, 0.0);
    const std::vector<std::uint8_t> counts = on_surface(from);
    // Blocks have a fixed size, so that each query starts from the same radius on any number of threads.
    constexpr std::size_t kBlock = 256;
    tbb::parallel_for(std::size_t{0}, (n + kBlock - 1) / kBlock, [&](std::size_t block) {
        const std::size_t begin = block * kBlock, end = std::min(n, begin + kBlock);
        Vec3 last = Vec3::Zero();
        bool first = true;
        for (std::size_t i = begin; i < end; ++i) {
            if (!counts[i]) continue;
            const Vec3& p = from.vertices[i];
            // The previous closest point lies on the surface, so its distance to p bounds the search.
            const double radius = first ? kInfinity : (p - last).norm() * (1.0 + 1e-9);
            SurfaceHit hit = to.closest_point(p, radius);
            if (!hit) hit = to.closest_point(p, kInfinity);
            result.per_vertex[i] = hit.distance;
            last = hit.point;
            first = false;
        }
    });
    double sum = 0.0;
    for (const double d : result.per_vertex) {
        sum += d;
        result.max = std::max(result.max, d);
    }
    result.mean = sum / static_cast<double>(std::count(counts.begin(), counts.end(), 1));
    return result;
}

TwoSidedDistance two_sided_distance(const TriangleMesh& first, const TriangleMesh& second) {
    TwoSidedDistance result{distance(first, second), distance(second, first), 0.0, 0.0};
    result.max = std::max(result.forward.max, result.backward.max);
    result.mean = std::max(result.forward.mean, result.backward.mean);
    return result;
}

SignedDistance::SignedDistance(const TriangleMesh& mesh)
    : scene_(mesh),
      face_(triangle_normals(mesh)),
      vertex_(vertex_normals(mesh, face_)),
      edge_(edge_normals(mesh, face_)) {}

DistanceSample SignedDistance::at(const Vec3& point, double radius) const {
    DistanceSample sample;
    sample.nearest = scene_.closest_point(point, radius);
    if (!sample.nearest) sample.nearest = scene_.closest_point(point, 1e30);
    if (!sample.nearest)
        throw GeometryError(
            "a mesh is too large for distances in single precision: give its coordinates in a larger unit");
    const SurfaceHit& hit = sample.nearest;
    const Triangle& triangle = scene_.triangles()[hit.triangle];
    const double weight[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
    constexpr double kOn = 1e-9;
    Vec3 normal = face_[hit.triangle];
    for (std::size_t k = 0; k < 3; ++k)
        if (weight[(k + 2) % 3] < kOn) normal = edge_[hit.triangle][k];
    for (std::size_t k = 0; k < 3; ++k)
        if (weight[k] > 1.0 - kOn) normal = vertex_[triangle[k]];
    const Vec3 way = point - hit.point;
    sample.distance = way.dot(normal) < 0.0 ? -hit.distance : hit.distance;
    // This near the surface, point - hit.point is rounding error: the gradient is the normal.
    const bool on = hit.distance <= 1e-9 * point.cwiseAbs().maxCoeff();
    sample.rise = on ? normal.normalized() : Vec3(way / sample.distance);
    return sample;
}

}  // namespace sidewall::surface
