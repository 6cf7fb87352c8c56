#include "surface/distance.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "surface/error.hpp"

namespace sidewall::surface {
namespace {

// One flag a vertex: whether a triangle uses it. A mesh without triangles is its points.
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
    // Blocks are fixed, so that each query starts from the same radius on any number of threads.
    constexpr std::size_t kBlock = 256;
    tbb::parallel_for(std::size_t{0}, (n + kBlock - 1) / kBlock, [&](std::size_t block) {
        const std::size_t begin = block * kBlock, end = std::min(n, begin + kBlock);
        Vec3 last = Vec3::Zero();
        bool first = true;
        for (std::size_t i = begin; i < end; ++i) {
            if (!counts[i]) continue;
            const Vec3& p = from.vertices[i];
            // The last vertex's nearest point is on the surface: nothing farther can be nearest to this one.
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

}  // namespace sidewall::surface
