#include "flux/wedges.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "flux/lateral.hpp"
#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::flux {
namespace {

// Groups the corners of one vertex into fans: fan[i] becomes the index of the first corner of corner i's fan.
template <typename Smooth>
void group_fans(const TriangleMesh& mesh, std::span<const std::uint32_t> corners, const Smooth& smooth,
                std::vector<std::uint32_t>& fan) {
    const auto root = [&](std::uint32_t i) {
        while (fan[i] != i) i = fan[i] = fan[fan[i]];
        return i;
    };
    fan.resize(corners.size());
    std::iota(fan.begin(), fan.end(), 0u);
    // Two corners are neighbours where one's outgoing edge at the vertex is the other's incoming edge.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> incoming(corners.size());
    for (std::uint32_t i = 0; i < corners.size(); ++i)
        incoming[i] = {mesh.triangles[corners[i] / 3][(corners[i] % 3 + 2) % 3], i};
    std::sort(incoming.begin(), incoming.end());
    for (std::uint32_t i = 0; i < corners.size(); ++i) {
        const std::uint32_t triangle = corners[i] / 3;
        const std::uint32_t outgoing = mesh.triangles[triangle][(corners[i] % 3 + 1) % 3];
        auto touching = std::lower_bound(incoming.begin(), incoming.end(), std::pair(outgoing, 0u));
        for (; touching != incoming.end() && touching->first == outgoing; ++touching) {
            const std::uint32_t j = touching->second;
            if (!smooth(triangle, corners[j] / 3)) continue;
            const std::uint32_t a = root(i), b = root(j);
            fan[std::max(a, b)] = std::min(a, b);
        }
    }
    for (std::uint32_t i = 0; i < corners.size(); ++i) fan[i] = root(i);
}

}  // namespace

Wedges make_wedges(const TriangleMesh& mesh, std::span<const std::int32_t> materials, double crease) {
    require_traceable(mesh);
    if (!materials.empty() && materials.size() != mesh.triangles.size())
        throw GeometryError("{} materials for {} triangles: give one a triangle", materials.size(),
                            mesh.triangles.size());
    const std::vector<Vec3> normals = triangle_normals(mesh);
    const double cosine = std::cos(crease);
    const auto smooth = [&](std::uint32_t s, std::uint32_t t) {
        if (!materials.empty() && materials[s] != materials[t]) return false;
        // A triangle without area has no normal: it is joined to all its neighbours.
        return normals[s].dot(normals[t]) > cosine || normals[s].isZero(0.0) || normals[t].isZero(0.0);
    };

    const surface::Rows corners_at = surface::vertex_corners(mesh);
    Wedges wedges;
    wedges.corner.resize(3 * mesh.triangles.size());
    wedges.first.assign(mesh.vertices.size() + 1, 0);
    // Number the wedges within each vertex first, then, once all are counted, in the whole mesh.
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
        const auto corners = corners_at[v];
        thread_local std::vector<std::uint32_t> fan;
        group_fans(mesh, corners, smooth, fan);
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < corners.size(); ++i)
            wedges.corner[corners[i]] = fan[i] == i ? count++ : wedges.corner[corners[fan[i]]];
        wedges.first[v + 1] = count;
    });
    std::partial_sum(wedges.first.begin(), wedges.first.end(), wedges.first.begin());
    wedges.area.assign(wedges.first.back(), 0.0);
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
        for (const std::uint32_t c : corners_at[v]) {
            wedges.corner[c] += wedges.first[v];
            wedges.area[wedges.corner[c]] += triangle_area(mesh, c / 3) / 3.0;
        }
    });
    return wedges;
}

std::vector<Vec3> wedge_normals(const TriangleMesh& mesh, const Wedges& wedges) {
    std::vector<Vec3> normals(wedges.count(), Vec3::Zero());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        normals[wedges.corner[c]] += area_vector(mesh, c / 3);
    for (Vec3& normal : normals) normal.normalize();
    return normals;
}

std::vector<std::int32_t> wedge_materials(const Wedges& wedges, std::span<const std::int32_t> materials) {
    std::vector<std::int32_t> by_wedge(wedges.count(), 0);
    for (std::size_t c = 0; c < wedges.corner.size() && !materials.empty(); ++c)
        by_wedge[wedges.corner[c]] = materials[c / 3];
    return by_wedge;
}

}  // namespace sidewall::flux
