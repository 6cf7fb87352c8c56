#include "simplify/halfedges.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <span>

#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

std::string place(const TriangleMesh& mesh, std::uint32_t v) {
    const Vec3& p = mesh.vertices[v];
    return fmt::format("vertex {} ({:.6g}, {:.6g}, {:.6g})", v, p.x(), p.y(), p.z());
}

struct Outgoing {
    std::uint32_t target, halfedge;
};

/// Halfedges leaving each vertex, in rows: those of v are list[start[v]] to list[start[v + 1]], sorted by the
/// vertex they run to.
struct OutgoingRows {
    std::vector<std::uint32_t> start;
    std::vector<Outgoing> list;
    std::span<const Outgoing> operator[](std::uint32_t v) const {
        return std::span(list).subspan(start[v], start[v + 1] - start[v]);
    }
    /// The first one from \p v to \p target, or the row's end.
    std::span<const Outgoing>::iterator find(std::uint32_t v, std::uint32_t target) const {
        const auto row = (*this)[v];
        constexpr std::size_t kFew = 16;
        const auto before = [target](const Outgoing& o) { return o.target < target; };
        auto at = row.begin();
        if (row.size() > kFew)
            at = std::partition_point(row.begin(), row.end(), before);
        else
            while (at != row.end() && before(*at)) ++at;
        return at;
    }
    std::size_t count(std::uint32_t v, std::uint32_t target) const {
        std::size_t n = 0;
        for (auto at = find(v, target); at != (*this)[v].end() && at->target == target; ++at) ++n;
        return n;
    }
};

OutgoingRows outgoing_halfedges(const TriangleMesh& mesh) {
    const auto vertices = static_cast<std::uint32_t>(mesh.vertices.size());
    OutgoingRows out;
    out.start.assign(mesh.vertices.size() + 1, 0);
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) ++out.start[v + 1];
    for (std::size_t v = 0; v < vertices; ++v) out.start[v + 1] += out.start[v];
    out.list.resize(3 * mesh.triangles.size());
    std::vector<std::uint32_t> next(out.start.begin(), out.start.end() - 1);
    std::uint32_t h = 0;
    for (const Triangle& t : mesh.triangles)
        for (std::uint32_t k = 0; k < 3; ++k, ++h) out.list[next[t[k]]++] = {t[k == 2 ? 0 : k + 1], h};
    tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t v) {
        std::sort(out.list.begin() + out.start[v], out.list.begin() + out.start[v + 1],
                  [](const Outgoing& a, const Outgoing& b) {
                      return a.target != b.target ? a.target < b.target : a.halfedge < b.halfedge;
                  });
    });
    return out;
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

/// Whether the triangles around a vertex form one fan: walking from edge to edge reaches them all.
/// \returns how many it reaches.
std::uint32_t fan_size(const OutgoingRows& out, const std::vector<std::uint32_t>& opposite, std::uint32_t v) {
    const std::uint32_t first = out[v].front().halfedge;
    std::uint32_t reached = 1, h = first;
    while ((h = opposite[previous_in_triangle(h)]) != kNoHalfedge && h != first) ++reached;
    if (h == kNoHalfedge)
        for (h = first; (h = opposite[h]) != kNoHalfedge; h = next_in_triangle(h), ++reached) {
        }
    return reached;
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
    const OutgoingRows out = outgoing_halfedges(mesh);
    const auto vertices = static_cast<std::uint32_t>(mesh.vertices.size());
    Halfedges result;
    result.opposite.assign(out.list.size(), kNoHalfedge);
    std::atomic<bool> sound = true;
    tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t v) {
        const auto row = out[v];
        for (std::size_t i = 0; i < row.size(); ++i) {
            if (i > 0 && row[i].target == row[i - 1].target) sound = false;
            const auto back = out.find(row[i].target, v);
            if (back != out[row[i].target].end() && back->target == v)
                result.opposite[row[i].halfedge] = back->halfedge;
        }
    });
    if (!sound)  // name the first place
        for (std::uint32_t h = 0; h < out.list.size(); ++h) {
            const Triangle& t = mesh.triangles[h / 3];
            const std::uint32_t a = t[h % 3], b = t[next_in_triangle(h) % 3];
            const std::size_t same = out.count(a, b), against = out.count(b, a);
            if (same > 1 || against > 1) refuse_edge(mesh, a, b, static_cast<int>(same + against));
        }
    tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t v) {
        if (out[v].size() > 1 && fan_size(out, result.opposite, v) != out[v].size()) sound = false;
    });
    for (std::uint32_t v = 0; !sound && v < vertices; ++v) {
        if (out[v].size() < 2) continue;
        const std::uint32_t reached = fan_size(out, result.opposite, v);
        if (reached != out[v].size())
            throw GeometryError(
                fmt::format("{}: only {} of its {} triangles hang together by edges, so the surface is not "
                            "manifold; give each part its own copy of the vertex",
                            place(mesh, v), reached, out[v].size()));
    }
    return result;
}

}  // namespace sidewall::simplify
