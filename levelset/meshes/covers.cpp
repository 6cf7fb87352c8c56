#include "levelset/meshes/covers.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/grid.hpp"

namespace sidewall::levelset {
namespace {

// Cells: on the underside of a layer, a lower layer is exposed only where it is at least this thick. Both
// fronts coincide there, and re-distancing moves them by a few hundredths of a cell.
constexpr double kUnderside = 0.1;

// Cells squared: a grid edge is parallel to the mesh if the mesh's level set changes by less than the root.
constexpr double kAlong = 0.05;

// The height of a mesh vertex above a lower layer's continued front, in cells: positive where the material
// between the two is exposed. \p of is the mesh's layer.
double cover(const Fronts& fronts, const GridEdge& edge, std::size_t of, std::size_t layer) {
    const double dx = fronts.spacing(edge);
    const double g[] = {fronts.value(of, edge, 0), fronts.value(of, edge, 1)};
    const double f[] = {fronts.continued(layer, edge, 0), fronts.continued(layer, edge, 1)};
    const double height = (f[0] + edge.t * (f[1] - f[0])) / dx, fall = g[0] - g[1];
    // Slope of the layer's front against the mesh's along the grid edge: -1 if parallel (less than
    // thinnest_film between them counts as nothing), 1 if the mesh is the underside of what lies on the
    // layer. It is 0 if the grid edge is parallel to the mesh and shows neither.
    const double slope = std::clamp((f[1] - f[0]) * fall / (fall * fall + kAlong * dx * dx), -1.0, 1.0);
    return height + slope * (slope > 0.0 ? kUnderside : fronts.touching(edge));
}

// Cells: how far from a sharp edge of the mesh its faces are tested, and above which height they are covered.
constexpr double kBeside = 0.4, kAbove = 0.1;

// Cells: a vertex with a smaller cover may lie on the layer's front.
constexpr double kOnFront = 0.05;

// The part of a smooth face of the mesh around a vertex on a sharp edge.
struct MeshFace {
    std::vector<std::uint32_t> around;  // vertices on no sharp edge
    std::vector<Vec3> beside;           // a point on each triangle
    bool covered = false;
};

struct EdgeVertex {
    std::uint32_t vertex;
    std::vector<MeshFace> faces;
};

// Adds a triangle around a vertex. Two triangles belong to one face if they share an edge from the vertex
// that is not sharp.
void add_triangle(const TriangleMesh& mesh, const std::vector<std::uint8_t>& on_edge, const Triangle& t,
                  double dx, EdgeVertex& at) {
    MeshFace joined;
    const Vec3& own = mesh.vertices[at.vertex];
    Vec3 way = Vec3::Zero(), along = Vec3::Zero();
    for (const std::uint32_t v : t) {
        way += mesh.vertices[v] - own;
        if (!on_edge[v])
            joined.around.push_back(v);
        else if (v != at.vertex)
            along = (mesh.vertices[v] - own).normalized();
    }
    if (joined.around.empty()) return;
    way -= way.dot(along) * along;  // perpendicular to the edge, however thin the triangle
    joined.beside.emplace_back(own + kBeside * dx * way.normalized());
    std::erase_if(at.faces, [&](const MeshFace& face) {
        const bool shares = std::ranges::any_of(
            joined.around, [&](std::uint32_t v) { return std::ranges::count(face.around, v) > 0; });
        if (!shares) return false;
        joined.around.insert(joined.around.end(), face.around.begin(), face.around.end());
        joined.beside.insert(joined.beside.end(), face.beside.begin(), face.beside.end());
        return true;
    });
    at.faces.push_back(std::move(joined));
}

std::vector<EdgeVertex> edge_vertices(const Fronts& fronts, const TriangleMesh& mesh,
                                      const std::vector<std::uint8_t>& on_edge) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> corners;  // a vertex on sharp edges, a triangle
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (on_edge[v]) corners.emplace_back(v, t);
    std::sort(corners.begin(), corners.end());
    std::vector<EdgeVertex> vertices;
    double dx = 0.0;
    for (const auto& [v, t] : corners) {
        if (vertices.empty() || vertices.back().vertex != v) {
            vertices.push_back({v, {}});
            dx = fronts.spacing(mesh.vertices[v]);
        }
        add_triangle(mesh, on_edge, mesh.triangles[t], dx, vertices.back());
    }
    return vertices;
}

// The cover of a vertex on sharp edges. If some of its faces are covered and others bare, it is kOnLine,
// which vertices beside it on the layer's front get, too. Else it is the mean of the vertices around.
double cover_on_edge(const Fronts& fronts, std::size_t layer, std::vector<MeshFace>& faces,
                     std::vector<double>& cover) {
    bool covered = false, bare = false, mixed = false;
    double sum = 0.0;
    std::size_t count = 0;
    for (MeshFace& face : faces) {
        const auto above = std::ranges::count_if(
            face.beside, [&](const Vec3& p) { return fronts.height(layer, p) > kAbove; });
        mixed |= above > 0 && above < std::ssize(face.beside);
        face.covered = above > 0;
        (face.covered ? covered : bare) = true;
        for (const std::uint32_t v : face.around) sum += cover[v], ++count;
    }
    if (!covered || !bare || mixed) return count > 0 ? sum / static_cast<double>(count) : 0.0;
    for (const MeshFace& face : faces)
        for (const std::uint32_t v : face.around)
            if (std::abs(cover[v]) <= kOnFront && (cover[v] > 0.0) != face.covered) cover[v] = kOnLine;
    return kOnLine;
}

}  // namespace

std::vector<std::uint8_t> on_edges(const TriangleMesh& mesh) {
    std::vector<std::uint8_t> edge(mesh.vertices.size(), 0);
    if (const auto* kind = mesh.vertex_attribute(kEdgeAttribute))
        for (std::size_t v = 0; v < edge.size(); ++v) edge[v] = kind->values[v] != 0.0;
    return edge;
}

std::vector<std::vector<double>> heights_above_fronts(const Fronts& shared, std::size_t of,
                                                      const TriangleMesh& mesh) {
    std::vector<std::vector<double>> covers(of, std::vector<double>(mesh.vertices.size()));
    if (of == 0) return covers;
    const std::vector<std::uint8_t> edge = on_edges(mesh);
    std::vector<std::uint8_t> within(mesh.vertices.size(), 0);  // by vertex: on no grid edge
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.vertices.size(), 1024), [&](const auto& range) {
        const Fronts fronts = shared;  // NOLINT(performance-unnecessary-copy-initialization): accessors cache
        for (std::size_t v = range.begin(); v != range.end(); ++v) {
            if (edge[v]) continue;
            const GridEdge on = fronts.edge_of(mesh.vertices[v]);
            within[v] = !on.on_grid_edge;
            for (std::size_t k = 0; k < of && on.on_grid_edge; ++k) covers[k][v] = cover(fronts, on, of, k);
        }
    });
    // A vertex within a cell is the centre of those around and gets their mean.
    std::vector<double> around(mesh.vertices.size(), 0.0);
    each_around(mesh, within, [&](std::uint32_t centre, std::uint32_t v) {
        ++around[centre];
        for (std::vector<double>& c : covers) c[centre] += c[v];
    });
    for (std::size_t v = 0; v < around.size(); ++v)
        for (std::vector<double>& c : covers)
            if (around[v] > 0.0) c[v] /= around[v];
    for (auto& [v, faces] : edge_vertices(shared, mesh, edge))
        for (std::size_t k = of; k-- > 0;) covers[k][v] = cover_on_edge(shared, k, faces, covers[k]);
    return covers;
}

}  // namespace sidewall::levelset
