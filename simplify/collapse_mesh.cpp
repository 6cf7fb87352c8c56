#include "simplify/collapse_mesh.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::simplify {
namespace {

std::string place(const TriangleMesh& mesh, std::uint32_t v) {
    const Vec3& p = mesh.vertices[v];
    return fmt::format("vertex {} ({:.6g}, {:.6g}, {:.6g})", v, p.x(), p.y(), p.z());
}

/// End vertex of a halfedge.
std::uint32_t target_of(const TriangleMesh& mesh, std::uint32_t h) {
    return mesh.triangles[h / 3][CollapseMesh::next(h) % 3];
}

/// Halfedges leaving each vertex, sorted by their end vertices.
surface::Rows outgoing_halfedges(const TriangleMesh& mesh) {
    surface::Rows out = surface::vertex_corners(mesh);
    tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t v) {
        std::sort(out.items.begin() + out.offsets[v], out.items.begin() + out.offsets[v + 1],
                  [&](std::uint32_t a, std::uint32_t b) {
                      return std::pair(target_of(mesh, a), a) < std::pair(target_of(mesh, b), b);
                  });
    });
    return out;
}

/// Halfedges that end at \p target, out of a \p row of outgoing_halfedges().
std::span<const std::uint32_t> running_to(const TriangleMesh& mesh, std::span<const std::uint32_t> row,
                                          std::uint32_t target) {
    const auto first = std::partition_point(row.begin(), row.end(),
                                            [&](std::uint32_t h) { return target_of(mesh, h) < target; });
    const auto last =
        std::find_if(first, row.end(), [&](std::uint32_t h) { return target_of(mesh, h) != target; });
    return {first, last};
}

[[noreturn]] void refuse_edge(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, int triangles) {
    const std::string edge = fmt::format("edge between {} and {}", place(mesh, a), place(mesh, b));
    if (triangles > 2)
        throw GeometryError(
            "{} has {} triangles, so the surface is not manifold; remove duplicate or "
            "inner triangles there",
            edge, triangles);
    throw GeometryError(
        "{}: its two triangles are oriented against each other; reverse one side so that "
        "all normals point out of the material, or remove duplicate triangles",
        edge);
}

/// Walks from triangle to triangle around vertex \p v, in both directions if it is on the boundary.
/// \returns how many triangles it reaches: all of the vertex's if they form a single fan.
std::uint32_t fan_size(const surface::Rows& out, const std::vector<std::uint32_t>& opposite,
                       std::uint32_t v) {
    const std::uint32_t first = out[v].front();
    std::uint32_t reached = 1, h = first;
    while ((h = opposite[CollapseMesh::previous(h)]) != kNoHalfedge && h != first) ++reached;
    if (h == kNoHalfedge)
        for (h = first; (h = opposite[h]) != kNoHalfedge; h = CollapseMesh::next(h), ++reached) {
        }
    return reached;
}

/// A power of two that scales the mean edge length to about 1.
double unit_scale(const TriangleMesh& mesh) {
    // About a thousand edges suffice for the order of magnitude.
    const std::size_t stride = std::max<std::size_t>(1, mesh.triangles.size() / 1000);
    double sum = 0.0, count = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); t += stride) {
        sum += (mesh.vertices[mesh.triangles[t][0]] - mesh.vertices[mesh.triangles[t][1]]).norm();
        ++count;
    }
    return sum > 0.0 ? std::exp2(-std::round(std::log2(sum / count))) : 1.0;
}

}  // namespace

void check_arrays(const TriangleMesh& mesh) {
    if (mesh.triangles.size() >= kNoHalfedge / 3 || mesh.vertices.size() >= kNoHalfedge)
        throw GeometryError("mesh of {} triangles: at most {} can be simplified at once; split it",
                            mesh.triangles.size(), kNoHalfedge / 3 - 1);
    constexpr double kLargest = 1e50;  // costs hold sixth powers of lengths
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        if (!mesh.vertices[v].allFinite())
            throw GeometryError("vertex {} is not finite; repair or extract the mesh again", v);
        if (mesh.vertices[v].cwiseAbs().maxCoeff() > kLargest)
            throw GeometryError("{} is too large a coordinate; scale the mesh to its length unit",
                                place(mesh, static_cast<std::uint32_t>(v)));
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        if (std::max({a, b, c}) >= mesh.vertices.size())
            throw GeometryError("triangle {} names vertex {}, but there are only {}; the mesh is damaged", t,
                                std::max({a, b, c}), mesh.vertices.size());
        if (a == b || b == c || c == a)
            throw GeometryError("triangle {} uses {} twice; remove degenerate triangles first", t,
                                place(mesh, a == b ? a : c));
    }
}

std::vector<std::uint32_t> opposite_halfedges(const TriangleMesh& mesh) {
    check_arrays(mesh);
    const surface::Rows out = outgoing_halfedges(mesh);
    const auto vertices = static_cast<std::uint32_t>(mesh.vertices.size());
    std::vector<std::uint32_t> opposite(out.items.size(), kNoHalfedge);
    std::atomic<bool> sound = true;
    tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t v) {
        std::uint32_t before = v;  // no halfedge of v ends at v
        for (const std::uint32_t h : out[v]) {
            const std::uint32_t w = target_of(mesh, h);
            if (w == before) sound = false;
            before = w;
            const auto back = running_to(mesh, out[w], v);
            if (!back.empty()) opposite[h] = back.front();
        }
    });
    if (!sound)  // report the first bad edge
        for (std::uint32_t h = 0; h < opposite.size(); ++h) {
            const std::uint32_t a = mesh.triangles[h / 3][h % 3], b = target_of(mesh, h);
            const std::size_t same = running_to(mesh, out[a], b).size(),
                              against = running_to(mesh, out[b], a).size();
            if (same > 1 || against > 1) refuse_edge(mesh, a, b, static_cast<int>(same + against));
        }
    tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t v) {
        if (out[v].size() > 1 && fan_size(out, opposite, v) != out[v].size()) sound = false;
    });
    for (std::uint32_t v = 0; !sound && v < vertices; ++v) {
        if (out[v].size() < 2) continue;
        const std::uint32_t reached = fan_size(out, opposite, v);
        if (reached != out[v].size())
            throw GeometryError(
                "{}: only {} of its {} triangles hang together by edges, so the surface is not "
                "manifold; give each part its own copy of the vertex",
                place(mesh, v), reached, out[v].size());
    }
    return opposite;
}

TriangleMesh assemble(const TriangleMesh& input, std::span<const std::uint32_t> corner,
                      const std::function<Vec3(std::uint32_t)>& position) {
    TriangleMesh result;
    std::vector<std::uint32_t> renamed(input.vertices.size(), kNoHalfedge);
    for (const std::uint32_t v : corner)
        if (v != kNoHalfedge) renamed[v] = 0;
    for (std::uint32_t v = 0; v < renamed.size(); ++v) {
        if (renamed[v] == kNoHalfedge) continue;
        renamed[v] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(position(v));
    }
    const Attribute* material = input.triangle_attribute("material");
    if (material) result.triangle_attributes.push_back({material->name, 1, material->type, {}});
    for (std::size_t t = 0; t < input.triangles.size(); ++t) {
        if (corner[3 * t] == kNoHalfedge) continue;
        result.triangles.push_back(
            {renamed[corner[3 * t]], renamed[corner[3 * t + 1]], renamed[corner[3 * t + 2]]});
        if (material) result.triangle_attributes[0].values.push_back(material->values[t]);
    }
    return result;
}

CollapseMesh::CollapseMesh(const TriangleMesh& input) {
    opposite = opposite_halfedges(input);
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
        // At a boundary vertex the fan begins with the boundary edge that leaves it.
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

    // Triangle (v0, v1, vl), left of h, vanishes: its two other edges become one.
    const std::uint32_t v1_vl = next(h), vl_v0 = previous(h), vl = corner[vl_v0];
    const std::uint32_t vl_v1 = opposite[v1_vl], v0_vl = opposite[vl_v0];
    if (vl_v1 != kNoHalfedge) opposite[vl_v1] = v0_vl;
    if (v0_vl != kNoHalfedge) opposite[v0_vl] = vl_v1;
    if (leaving[vl] == vl_v0) leaving[vl] = vl_v1;
    if (first_of_v1 == v1_vl) first_of_v1 = v0_vl;  // v1 vl was a boundary edge: v0 vl becomes one
    inner = v0_vl;
    if (other != kNoHalfedge) {
        // Triangle (v1, v0, vr), right of h, vanishes.
        const std::uint32_t v0_vr = next(other), vr_v1 = previous(other), vr = corner[vr_v1];
        const std::uint32_t vr_v0 = opposite[v0_vr], v1_vr = opposite[vr_v1];
        if (vr_v0 != kNoHalfedge) opposite[vr_v0] = v1_vr;
        if (v1_vr != kNoHalfedge) opposite[v1_vr] = vr_v0;
        if (leaving[vr] == vr_v1) leaving[vr] = vr_v0;
        if (leaving[v0] == v0_vr && v0_boundary) leaving[v0] = v1_vr;
        for (std::uint32_t k = 0; k < 3; ++k) corner[other / 3 * 3 + k] = kNoHalfedge;
    }
    for (std::uint32_t k = 0; k < 3; ++k) corner[h / 3 * 3 + k] = kNoHalfedge;
    // If v1 was on the boundary, v0 begins with the boundary edge that left v1; else v0 keeps its own.
    if (v1_boundary) leaving[v0] = first_of_v1;
    if (!v0_boundary && !v1_boundary) leaving[v0] = inner;
    leaving[v1] = kNoHalfedge;
}

}  // namespace sidewall::simplify
