#include "levelset/meshes/contact_lines.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "levelset/large_vector.hpp"
#include "levelset/meshes/covers.hpp"
#include "levelset/meshes/divide.hpp"
#include "levelset/meshes/extract.hpp"
#include "levelset/meshes/fronts.hpp"
#include "levelset/meshes/nearest_on_segments.hpp"
#include "surface/distance.hpp"
#include "surface/extraction/marching_cubes.hpp"

namespace sidewall::levelset {
namespace {

// Cells: how far from a mesh edge between two fronts their contact line is searched.
constexpr double kNear = 2.0;

// Share of such an edge, from its end on the upper front, where the search starts: the line is on that front.
constexpr double kFromFoot = 0.25;

// Cells: how far marching cubes must have cut off a corner for it to be restored. Fronts whose normals differ
// by less than 32 degrees (cosine kAlike) have no corner: there a film tapers off.
constexpr double kLeastCorner = 0.05, kAlike = 0.85;

// Cells: a restored corner this close to an end of the edge that it divides, and not between its ends, would
// fold the triangles at that end.
constexpr double kNearEnd = 0.15;

// Least cosine between the normals of a triangle and its parts: the sides of a restored corner turn by nearly
// a right angle from the triangle that cut it off if one side is short.
constexpr double kFolded = -0.8;

// Cells: shorter edges, which arise beside nodes, are not divided: their parts would have no area.
constexpr double kShortEdge = 0.05;

// Cells: a larger rise along a grid edge is not that of a distance.
constexpr double kFar = 5.0;

constexpr std::size_t kOpen = static_cast<std::size_t>(-1);

// Keeps a point that divides the edge from a to b on the sides of the domain that the edge lies on.
void keep_on_sides(const Domain& domain, const Vec3& a, const Vec3& b, Vec3& point) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        if (a[k] == b[k] && (a[k] == domain.min[axis] || a[k] == domain.max[axis])) point[k] = a[k];
    }
}

bool is_short(const Domain& domain, const Vec3& a, const Vec3& b) {
    return (b - a).norm() < kShortEdge * domain.spacing;
}

// Divides one mesh where the layers below it come out.
class Cutter {
  public:
    Cutter(const MaterialStack& stack, std::size_t of, CutMesh& result,
           std::vector<std::vector<double>> covers)
        : domain_(stack.domain), of_(of), result_(result), covers_(std::move(covers)) {}

    // \returns the contact line of the layer right below.
    Segments run() {
        result_.layer.assign(result_.mesh.triangles.size(), of_ == 0 ? 0 : kOpen);
        open_.assign(result_.mesh.vertices.size(), 1);
        Segments rim;
        for (std::size_t k = of_; k-- > 0;) {
            Segments segments = cut_by(k);
            if (k + 1 == of_) rim = std::move(segments);
        }
        return rim;
    }

  private:
    EdgePoints divided_edges(std::size_t layer);
    void add_segment(const std::vector<double>& cover, const Triangle& t, const EdgePoints& points,
                     Segments& segments) const;
    void divide(std::size_t layer, const EdgePoints& points, Segments& segments);
    Segments cut_by(std::size_t layer) {
        const EdgePoints points = divided_edges(layer);
        Segments segments;
        divide(layer, points, segments);
        return segments;
    }

    const Domain& domain_;
    std::size_t of_;
    CutMesh& result_;
    std::vector<std::vector<double>> covers_;  // by layer and vertex
    std::vector<std::uint8_t> open_;           // by vertex: no layer tested so far is exposed there
};

// Adds a vertex at the zero of the cover on every mesh edge along which the cover changes sign.
EdgePoints Cutter::divided_edges(std::size_t layer) {
    std::vector<double>& cover = covers_[layer];
    std::vector<Vec3>& vertices = result_.mesh.vertices;
    EdgePoints points;
    for (const Triangle& t : result_.mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = std::min(t[k], t[(k + 1) % 3]), b = std::max(t[k], t[(k + 1) % 3]);
            if (!open_[a] || !open_[b] || (cover[a] > 0.0) == (cover[b] > 0.0)) continue;
            if (cover[a] == kOnLine || cover[b] == kOnLine) continue;
            if (is_short(domain_, vertices[a], vertices[b])) continue;
            if (!points.try_emplace(divided_edge(a, b), static_cast<std::uint32_t>(vertices.size())).second)
                continue;
            constexpr double kClear = 0.05;  // of the edge, so that no triangle has zero area
            const double share = std::clamp(cover[a] / (cover[a] - cover[b]), kClear, 1.0 - kClear);
            result_.added.push_back({a, b, share});
            vertices.emplace_back(vertices[a] + share * (vertices[b] - vertices[a]));
            open_.push_back(1);
            for (std::vector<double>& c : covers_) c.push_back(c[a] + share * (c[b] - c[a]));
            cover.back() = 0.0;
        }
    return points;
}

// Adds the segment in a triangle or along its edge on which the cover is 0, if there is one.
void Cutter::add_segment(const std::vector<double>& cover, const Triangle& t, const EdgePoints& points,
                         Segments& segments) const {
    const std::vector<Vec3>& vertices = result_.mesh.vertices;
    std::array<Vec3, 3> ends;
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (cover[a] == kOnLine) ends[count++] = vertices[a];
        if ((cover[a] > 0.0) == (cover[b] > 0.0) || cover[a] == kOnLine || cover[b] == kOnLine) continue;
        const auto found = points.find(divided_edge(a, b));
        ends[count++] =
            found != points.end() ? vertices[found->second] : Vec3(0.5 * (vertices[a] + vertices[b]));
    }
    if (count == 2) segments.push_back({ends[0], ends[1]});
}

void Cutter::divide(std::size_t layer, const EdgePoints& points, Segments& segments) {
    const TriangleMesh& mesh = result_.mesh;
    const std::vector<double>& cover = covers_[layer];
    std::vector<Triangle> triangles;
    std::vector<std::size_t> layers;
    const std::size_t most = most_parts(mesh.triangles.size(), points);
    triangles.reserve(most);
    layers.reserve(most);
    const std::vector<std::uint8_t> ends = divided_ends(mesh, points);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& whole = mesh.triangles[t];
        const auto add = [&](const Triangle& part) {
            triangles.push_back(part);
            const bool covered =
                std::any_of(part.begin(), part.end(), [&](std::uint32_t v) { return cover[v] > 0.0; });
            if (result_.layer[t] != kOpen)
                layers.push_back(result_.layer[t]);
            else
                layers.push_back(covered ? layer + 1 : layer == 0 ? 0 : kOpen);
        };
        if (is_whole(whole, ends))
            add(whole);
        else
            for (const Triangle& part : parts_of(mesh, whole, points)) add(part);
        if (result_.layer[t] == kOpen) add_segment(cover, whole, points, segments);
    }
    result_.mesh.triangles = std::move(triangles);
    result_.layer = std::move(layers);
    for (std::size_t v = 0; v < open_.size(); ++v) open_[v] = open_[v] && cover[v] <= 0.0;
}

// Moves a vertex of a lower layer's mesh along its grid edge to the first continued front that the edge meets
// from inside, of the fronts of \p layer and of those above.
// \returns that front's layer.
std::size_t place(const Fronts& fronts, const GridEdge& edge, std::size_t layer, std::size_t layers,
                  Vec3& vertex) {
    const std::size_t in = fronts.value(layer, edge, 0) <= 0.0 ? 0 : 1, out = 1 - in;
    double least = 2.0;  // share of the edge from its inner end; above 1: no front met
    std::size_t met = layer;
    double t = edge.t;
    for (std::size_t k = layer; k < layers; ++k) {
        const double f[] = {fronts.continued(k, edge, 0), fronts.continued(k, edge, 1)};
        // A front that is unknown at one end lies far below: no crossing.
        if (f[out] <= 0.0 || f[in] > 0.0 || f[out] - f[in] > kFar * fronts.spacing(edge)) continue;
        const double here = f[in] / (f[in] - f[out]);
        // If fronts coincide, the upper one counts.
        if (here > least + fronts.touching(edge)) continue;
        least = here;
        met = k;
        t = f[0] / (f[0] - f[1]);
    }
    t = std::clamp(t, surface::kNodeClearance, 1.0 - surface::kNodeClearance);
    constexpr double kRounding = 1e-6;
    // A vertex off the linear crossing lies on a plane of a sharp edge beside it. It stays if the front met
    // coincides with the layer's own.
    const double g[] = {fronts.value(layer, edge, 0), fronts.value(layer, edge, 1)},
                 same = fronts.touching(edge) * fronts.spacing(edge);
    if (std::abs(edge.t - std::clamp(g[0] / (g[0] - g[1]), surface::kNodeClearance,
                                     1.0 - surface::kNodeClearance)) > kRounding &&
        std::abs(fronts.continued(met, edge, 0) - g[0]) <= same &&
        std::abs(fronts.continued(met, edge, 1) - g[1]) <= same)
        return met;
    if (std::abs(t - edge.t) > kRounding) vertex[edge.axis] += (t - edge.t) * fronts.spacing(edge);
    return met;
}

// Unit vertex normals by the triangles whose corners lie on one front; zero where there is no such triangle.
std::vector<Vec3> front_normals(const TriangleMesh& mesh, const std::vector<std::size_t>& front) {
    std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        if (front[a] != front[b] || front[a] != front[c]) continue;
        for (const std::uint32_t v : {a, b, c}) normals[v] += area_vector(mesh, t);
    }
    for (Vec3& normal : normals) normal.normalize();
    return normals;
}

// Moves vertices on sharp edges of a lower layer's mesh that lie outside the next upper mesh onto the latter:
// extrapolated planes may meet out there.
// \param on_edge  flags of the mesh's vertices.
void keep_inside(const Domain& domain, const TriangleMesh& above, const std::vector<std::uint8_t>& on_edge,
                 TriangleMesh& mesh) {
    if (std::ranges::count(on_edge, 1) == 0 || above.triangles.empty()) return;
    const surface::SignedDistance upper(above);
    tbb::parallel_for(std::size_t{0}, on_edge.size(), [&](std::size_t v) {
        if (!on_edge[v]) return;
        Vec3& vertex = mesh.vertices[v];
        const surface::DistanceSample at = upper.at(vertex, domain.spacing);
        if (!(at.distance > 0.0)) return;
        Vec3 moved = at.nearest.point;
        keep_on_sides(domain, vertex, vertex, moved);
        vertex = moved;
    });
}

// The mesh of a lower layer's boundary: its own front and, beyond its end, the fronts above it.
// \param rims  by layer from this one up: its contact line with the next layer.
// \param above  the next upper mesh.
TriangleMesh interface_mesh(const Fronts& fronts, const MaterialStack& stack, std::size_t layer,
                            const std::vector<NearestOnSegments>& rims, const TriangleMesh& above) {
    const Domain& domain = stack.domain;
    TriangleMesh mesh =
        extract_surface(stack, layer, [&](const MaterialStack& level, const std::array<int, 3>& cell) {
            return edges_at(level, layer, cell);
        });
    const std::vector<std::uint8_t> on_edge = on_edges(mesh);
    keep_inside(domain, above, on_edge, mesh);
    std::vector<std::size_t> front(mesh.vertices.size(), layer);
    std::vector<std::uint8_t> within(mesh.vertices.size(), 0);  // by vertex: sharp, or off grid edges
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, front.size(), 1024), [&](const auto& range) {
        const Fronts mine = fronts;  // NOLINT(performance-unnecessary-copy-initialization): accessors cache
        for (std::size_t v = range.begin(); v != range.end(); ++v) {
            const GridEdge edge = mine.edge_of(mesh.vertices[v]);
            within[v] = !edge.on_grid_edge || on_edge[v];
            if (!within[v]) front[v] = place(mine, edge, layer, stack.layers.size(), mesh.vertices[v]);
        }
    });
    each_around(mesh, within, [&](std::uint32_t centre, std::uint32_t v) {
        front[centre] = std::max(front[centre], front[v]);
    });
    const std::vector<Vec3> normals = front_normals(mesh, front);
    EdgePoints points;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t a = t[k], b = t[(k + 1) % 3];
            if (front[a] > front[b]) std::swap(a, b);
            const bool own = front[a] == front[b];  // a corner of the layer's own front may be cut off, too
            if ((own && front[a] != layer) || normals[a].dot(normals[b]) > kAlike) continue;
            if (points.contains(divided_edge(a, b))) continue;
            const Vec3 &from = mesh.vertices[a], &to = mesh.vertices[b];
            if (is_short(domain, from, to)) continue;
            std::optional<Vec3> point =  // keep_on_sides may move it
                rims[front[a]].at(to + (own ? 0.5 : kFromFoot) * (from - to));
            if (!point) continue;
            const Vec3 along = (to - from).normalized();
            if ((*point - from).cross(along).norm() < kLeastCorner * domain.spacing) continue;
            const auto just_beyond = [&](const Vec3& end, const Vec3& outward) {
                return (*point - end).dot(outward) > 0.0 && (*point - end).norm() < kNearEnd * domain.spacing;
            };
            if (just_beyond(from, -along) || just_beyond(to, along)) continue;
            keep_on_sides(domain, from, to, *point);
            points.emplace(divided_edge(a, b), static_cast<std::uint32_t>(mesh.vertices.size()));
            mesh.vertices.push_back(*point);
        }
    merge_near(mesh, kShortEdge * domain.spacing, points);
    drop_folds(mesh, kFolded, points);
    return divided(mesh, points);
}

}  // namespace

StackMeshes extract_materials(const MaterialStack& stack, const TriangleMesh& surface) {
    drop_kept_memory();  // of time steps
    const std::size_t top = stack.layers.size() - 1;
    StackMeshes meshes;
    std::vector<surface::SharpEdges> edges(top);
    for (std::size_t layer = 0; layer < top; ++layer) edges[layer] = edges_below(stack, layer);
    const auto own_front = [&](std::size_t layer) {
        TriangleMesh mesh = extract_surface(stack, layer, edges[layer]);
        mesh.vertex_attributes.clear();
        return mesh;
    };
    if (std::ranges::count(edges, surface::SharpEdges::none) == 0) {
        meshes.surface.mesh.vertices = surface.vertices;
        meshes.surface.mesh.triangles = surface.triangles;
        meshes.surface.layer.assign(surface.triangles.size(), top);
        for (std::size_t layer = 0; layer < top; ++layer) meshes.interfaces.push_back(own_front(layer));
        return meshes;
    }
    const Fronts fronts(stack);
    meshes.interfaces.resize(top);
    std::vector<NearestOnSegments> rims(top);
    for (std::size_t layer = top + 1; layer-- > 0;) {
        CutMesh cut;
        cut.mesh = layer == top ? surface
                                : interface_mesh(fronts, stack, layer, rims,
                                                 layer + 1 < top ? meshes.interfaces[layer + 1] : surface);
        std::vector<std::vector<double>> covers = heights_above_fronts(fronts, layer, cut.mesh);
        cut.mesh.vertex_attributes.clear();
        if (layer < top) meshes.interfaces[layer] = cut.mesh;
        Segments rim = Cutter(stack, layer, cut, std::move(covers)).run();
        if (layer > 0) rims[layer - 1] = NearestOnSegments(std::move(rim), kNear * stack.domain.spacing);
        if (layer == top)
            meshes.surface = std::move(cut);
        else if (edges[layer] != surface::SharpEdges::none)
            meshes.interfaces[layer] = own_front(layer);
    }
    return meshes;
}

}  // namespace sidewall::levelset
