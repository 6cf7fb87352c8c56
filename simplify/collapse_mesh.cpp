#include "simplify/collapse_mesh.hpp"

#include <tbb/parallel_for.h>

#include <cmath>

namespace sidewall::simplify {
namespace {

/// A power of two that brings the mean edge near to one.
double unit_scale(const TriangleMesh& mesh) {
    // A thousand edges give the magnitude.
    const std::size_t stride = std::max<std::size_t>(1, mesh.triangles.size() / 1000);
    double sum = 0.0, count = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); t += stride) {
        sum += (mesh.vertices[mesh.triangles[t][0]] - mesh.vertices[mesh.triangles[t][1]]).norm();
        ++count;
    }
    return sum > 0.0 ? std::exp2(-std::round(std::log2(sum / count))) : 1.0;
}

}  // namespace

CollapseMesh::CollapseMesh(const TriangleMesh& input) {
    opposite = connect(input).opposite;
    const auto vertices = static_cast<std::uint32_t>(input.vertices.size());
    const Box3 box = bounding_box(input);
    if (vertices > 0) centre = 0.5 * box.min + 0.5 * box.max;
    scale = unit_scale(input);
    low = to_mesh(box.min);
    high = to_mesh(box.max);

    corner.resize(opposite.size());
    leaving.assign(vertices, kNoHalfedge);
    state.resize(vertices);
    sums.resize(vertices);
    tbb::parallel_for(std::uint32_t{0}, vertices,
                      [&](std::uint32_t v) { sums[v].position = to_mesh(input.vertices[v]); });
    for (std::uint32_t h = 0; h < corner.size(); ++h) {
        corner[h] = input.triangles[h / 3][h % 3];
        // On the boundary the fan must begin at its first edge, the one without a triangle on its right.
        if (leaving[corner[h]] == kNoHalfedge || opposite[h] == kNoHalfedge) leaving[corner[h]] = h;
    }
    for (std::uint32_t h = 0; h < corner.size(); ++h)
        if (opposite[h] == kNoHalfedge)
            for (const std::uint32_t v : {start(h), end(h)}) {
                state[v].flags |= kBoundary;
                state[v].constraint = boundary_constraint(input.vertices[v], box);
            }
    constexpr std::uint32_t kGrain = 1024;
    tbb::parallel_for(std::uint32_t{0}, (vertices + kGrain - 1) / kGrain, [&](std::uint32_t block) {
        std::vector<std::uint32_t> neighbours;
        for (std::uint32_t v = block * kGrain; v < std::min(vertices, (block + 1) * kGrain); ++v)
            sum_up(v, neighbours);
    });
}

void CollapseMesh::sum_up(std::uint32_t v, std::vector<std::uint32_t>& neighbours) {
    VertexSums& s = sums[v];
    s.planes = {};
    s.normal = s.link = Vec3::Zero();
    s.link2 = 0.0;
    const std::uint32_t first = leaving[v];
    if (first == kNoHalfedge) return;
    neighbours.clear();
    std::uint32_t h = first, last = 0;
    do {
        neighbours.push_back(end(h));
        last = previous(h);
        h = opposite[last];
    } while (h != kNoHalfedge && h != first);
    if (h == kNoHalfedge) neighbours.push_back(start(last));
    const std::size_t n = neighbours.size(), triangles = h == kNoHalfedge ? n - 1 : n;
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3 a = position(neighbours[i]) - s.position;
        s.link += a;
        s.link2 += a.squaredNorm();
        if (i >= triangles) continue;
        const Vec3 normal = a.cross(position(neighbours[(i + 1) % n]) - s.position);
        s.normal += normal;
        s.planes.add_outer(normal, 1.0);
    }
    state[v].degree = static_cast<std::uint32_t>(n);
}

void CollapseMesh::ring(std::uint32_t v, OneRing& result) const {
    const std::uint32_t first = leaving[v];
    std::uint32_t h = first, last = 0, n = 0;
    do {
        result.out[n] = h;
        result.neighbours[n++] = end(h);
        last = previous(h);
        h = opposite[last];
    } while (h != kNoHalfedge && h != first);
    result.triangles = n;
    if (h == kNoHalfedge) result.neighbours[n++] = start(last);
    result.size = n;
}

void CollapseMesh::unlink(std::uint32_t h, const OneRing& end_ring) {
    const std::uint32_t v0 = start(h), v1 = end(h), other = opposite[h];
    const bool v0_boundary = flagged(v0, kBoundary), v1_boundary = flagged(v1, kBoundary);
    std::uint32_t first_of_v1 = leaving[v1], inner = kNoHalfedge;
    for (std::uint32_t i = 0; i < end_ring.triangles; ++i) corner[end_ring.out[i]] = v0;

    // Triangle v0, v1, vl left of h: its two other edges become one.
    const std::uint32_t v1_vl = next(h), vl_v0 = previous(h), vl = corner[vl_v0];
    const std::uint32_t vl_v1 = opposite[v1_vl], v0_vl = opposite[vl_v0];
    if (vl_v1 != kNoHalfedge) opposite[vl_v1] = v0_vl;
    if (v0_vl != kNoHalfedge) opposite[v0_vl] = vl_v1;
    if (leaving[vl] == vl_v0) leaving[vl] = vl_v1;
    if (first_of_v1 == v1_vl) first_of_v1 = v0_vl;  // v1 vl was the boundary; now v0 vl is
    inner = v0_vl;
    if (other != kNoHalfedge) {
        // Triangle v1, v0, vr on the other side.
        const std::uint32_t v0_vr = next(other), vr_v1 = previous(other), vr = corner[vr_v1];
        const std::uint32_t vr_v0 = opposite[v0_vr], v1_vr = opposite[vr_v1];
        if (vr_v0 != kNoHalfedge) opposite[vr_v0] = v1_vr;
        if (v1_vr != kNoHalfedge) opposite[v1_vr] = vr_v0;
        if (leaving[vr] == vr_v1) leaving[vr] = vr_v0;
        if (leaving[v0] == v0_vr && v0_boundary) leaving[v0] = v1_vr;
        for (std::uint32_t k = 0; k < 3; ++k) corner[other / 3 * 3 + k] = kNoHalfedge;
    }
    for (std::uint32_t k = 0; k < 3; ++k) corner[h / 3 * 3 + k] = kNoHalfedge;
    // The boundary goes on where it left v1, if v1 lay on it; else where it left v0.
    if (v1_boundary) leaving[v0] = first_of_v1;
    if (!v0_boundary && !v1_boundary) leaving[v0] = inner;
    leaving[v1] = kNoHalfedge;
}

}  // namespace sidewall::simplify
