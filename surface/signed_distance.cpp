#include "surface/signed_distance.hpp"

#include <algorithm>
#include <cmath>

#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

// Per vertex, the normals of its triangles, weighted by the angle under which each is seen from it.
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

}  // namespace

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
    // At a point this near, the way to the surface is rounding: its normal is the better answer.
    const bool on = hit.distance <= 1e-9 * point.cwiseAbs().maxCoeff();
    sample.rise = on ? normal.normalized() : Vec3(way / sample.distance);
    return sample;
}

}  // namespace sidewall::surface
