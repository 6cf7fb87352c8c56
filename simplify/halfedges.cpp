#include "simplify/halfedges.hpp"

#include <fmt/format.h>

#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

std::string place(const TriangleMesh& mesh, std::uint32_t v) {
    const Vec3& p = mesh.vertices[v];
    return fmt::format("vertex {} ({:.6g}, {:.6g}, {:.6g})", v, p.x(), p.y(), p.z());
}

/// Outgoing halfedges by vertex, in rows: those of v are list[start[v]] to list[start[v + 1]].
struct Outgoing {
    std::vector<std::uint32_t> start, list;
};

Outgoing outgoing_halfedges(const TriangleMesh& mesh) {
    Outgoing out;
    out.start.assign(mesh.vertices.size() + 1, 0);
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) ++out.start[v + 1];
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) out.start[v + 1] += out.start[v];
    out.list.resize(3 * mesh.triangles.size());
    std::vector<std::uint32_t> next(out.start.begin(), out.start.end() - 1);
    for (std::uint32_t h = 0; h < out.list.size(); ++h) out.list[next[mesh.triangles[h / 3][h % 3]]++] = h;
    return out;
}

std::uint32_t next_in_triangle(std::uint32_t h) {
    return h % 3 == 2 ? h - 2 : h + 1;
}

std::uint32_t previous_in_triangle(std::uint32_t h) {
    return h % 3 == 0 ? h + 2 : h - 1;
}

[[noreturn]] void refuse_edge(const TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, int triangles) {
    const std::string edge = fmt::format("edge between {} and {}", place(mesh, a), place(mesh, b));
    if (triangles > 2)
        throw GeometryError(
            fmt::format("{} has {} triangles, so the surface is not manifold; remove duplicate or "
                        "inner triangles there",
                        edge, triangles));
    throw GeometryError(
        fmt::format("{}: its two triangles are oriented against each other; reverse one side so that "
                    "all normals point out of the material, or remove duplicate triangles",
                    edge));
}

/// Triangles around a vertex must form one fan: walking from edge to edge reaches them all.
void check_fans(const TriangleMesh& mesh, const Outgoing& out, const std::vector<std::uint32_t>& opposite) {
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
        const std::uint32_t degree = out.start[v + 1] - out.start[v];
        if (degree < 2) continue;
        const std::uint32_t first = out.list[out.start[v]];
        std::uint32_t reached = 1, h = first;
        while ((h = opposite[previous_in_triangle(h)]) != kNoHalfedge && h != first) ++reached;
        if (h == kNoHalfedge)
            for (h = first; (h = opposite[h]) != kNoHalfedge; h = next_in_triangle(h), ++reached) {
            }
        if (reached != degree)
            throw GeometryError(
                fmt::format("{}: only {} of its {} triangles hang together by edges, so the surface is not "
                            "manifold; give each part its own copy of the vertex",
                            place(mesh, v), reached, degree));
    }
}

}  // namespace

void check_arrays(const TriangleMesh& mesh) {
    if (mesh.triangles.size() >= kNoHalfedge / 3 || mesh.vertices.size() >= kNoHalfedge)
        throw GeometryError(
            fmt::format("mesh of {} triangles: at most {} can be simplified at once; split it",
                        mesh.triangles.size(), kNoHalfedge / 3 - 1));
    constexpr double kLargest = 1e50;  // costs hold sixth powers of lengths
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        if (!mesh.vertices[v].allFinite())
            throw GeometryError(fmt::format("vertex {} is not finite; repair or extract the mesh again", v));
        if (mesh.vertices[v].cwiseAbs().maxCoeff() > kLargest)
            throw GeometryError(fmt::format("{} is too large a coordinate; scale the mesh to its length unit",
                                            place(mesh, static_cast<std::uint32_t>(v))));
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto [a, b, c] = mesh.triangles[t];
        if (std::max({a, b, c}) >= mesh.vertices.size())
            throw GeometryError(
                fmt::format("triangle {} names vertex {}, but there are only {}; the mesh is damaged", t,
                            std::max({a, b, c}), mesh.vertices.size()));
        if (a == b || b == c || c == a)
            throw GeometryError(fmt::format("triangle {} uses {} twice; remove degenerate triangles first", t,
                                            place(mesh, a == b ? a : c)));
    }
}

Halfedges connect(const TriangleMesh& mesh) {
    check_arrays(mesh);
    const Outgoing out = outgoing_halfedges(mesh);
    const auto target = [&](std::uint32_t h) { return mesh.triangles[h / 3][next_in_triangle(h) % 3]; };
    Halfedges result;
    result.opposite.assign(out.list.size(), kNoHalfedge);
    for (std::uint32_t h = 0; h < out.list.size(); ++h) {
        const std::uint32_t a = mesh.triangles[h / 3][h % 3], b = target(h);
        int same = 0, against = 0;
        for (std::uint32_t i = out.start[a]; i < out.start[a + 1]; ++i) same += target(out.list[i]) == b;
        for (std::uint32_t i = out.start[b]; i < out.start[b + 1]; ++i)
            if (target(out.list[i]) == a) {
                ++against;
                result.opposite[h] = out.list[i];
            }
        if (same > 1 || against > 1) refuse_edge(mesh, a, b, same + against);
    }
    check_fans(mesh, out, result.opposite);
    return result;
}

}  // namespace sidewall::simplify
