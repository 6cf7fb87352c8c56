#include "simplify/collapse.hpp"

#include <CGAL/Surface_mesh_simplification/edge_collapse.h>
#include <fmt/format.h>

#include <limits>

#include "simplify/cgal_policies.hpp"
#include "simplify/halfedges.hpp"
#include "surface/error.hpp"

namespace sidewall::simplify {
namespace {

using namespace cgal;
using Halfedge = Mesh::Halfedge_index;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// CGAL's half-edge structure from ours. Built by hand: its add_face depends on the order of triangles and
/// searches.
Mesh build(const TriangleMesh& input, const Halfedges& edges, const Vec3& centre) {
    const auto halfedges = static_cast<std::uint32_t>(edges.opposite.size());
    Mesh mesh;
    mesh.reserve(static_cast<Mesh::size_type>(input.vertices.size()), halfedges / 2 + halfedges / 8,
                 halfedges / 3);
    for (const Vec3& v : input.vertices) {
        const Vec3 p = v - centre;
        mesh.add_vertex(Point(p.x(), p.y(), p.z()));
    }
    std::vector<Halfedge> ours(halfedges), border_out(input.vertices.size());
    for (std::uint32_t h = 0; h < halfedges; ++h) {
        const std::uint32_t other = edges.opposite[h];
        if (other != kNoHalfedge && other < h) {
            ours[h] = mesh.opposite(ours[other]);
            continue;
        }
        const Triangle& t = input.triangles[h / 3];
        ours[h] = mesh.add_edge(Vertex(t[h % 3]), Vertex(t[(h + 1) % 3]));
        if (other == kNoHalfedge) border_out[t[(h + 1) % 3]] = mesh.opposite(ours[h]);
    }
    for (std::uint32_t t = 0; t < halfedges / 3; ++t) {
        const Mesh::Face_index face = mesh.add_face();
        mesh.set_halfedge(face, ours[3 * t]);
        for (std::uint32_t k = 0; k < 3; ++k) {
            mesh.set_face(ours[3 * t + k], face);
            mesh.set_next(ours[3 * t + k], ours[3 * t + (k + 1) % 3]);
            mesh.set_halfedge(Vertex(input.triangles[t][(k + 1) % 3]), ours[3 * t + k]);
        }
    }
    for (const Halfedge h : border_out)
        if (h.is_valid()) {
            mesh.set_next(h, border_out[mesh.target(h)]);
            mesh.set_halfedge(mesh.target(h), h);
        }
    for (const Vertex v : mesh.vertices())
        if (!mesh.halfedge(v).is_valid()) mesh.remove_vertex(v);
    return mesh;
}

/// Vertices where triangles of different material meet.
std::vector<std::uint8_t> material_borders(const TriangleMesh& mesh) {
    std::vector<std::uint8_t> border(mesh.vertices.size(), 0);
    const Attribute* material = mesh.triangle_attribute("material");
    if (!material) return border;
    if (material->components != 1 || material->values.size() != mesh.triangles.size())
        throw GeometryError(
            fmt::format("attribute `material` has {} values of {} components for {} triangles: give one "
                        "number a triangle",
                        material->values.size(), material->components, mesh.triangles.size()));
    std::vector<double> seen(mesh.vertices.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double value = material->values[t];
        if (!std::isfinite(value))
            throw GeometryError(
                fmt::format("attribute `material` of triangle {} is not a number; repair the mesh", t));
        for (const std::uint32_t v : mesh.triangles[t]) {
            if (std::isnan(seen[v])) seen[v] = value;
            if (seen[v] != value) border[v] = 1;
        }
    }
    return border;
}

}  // namespace

struct CollapseEngine::Impl {
    const TriangleMesh& input;
    sms::internal::LindstromTurk_params weights;
    // Positions are relative to the centre: the cost's determinants cancel badly far from the origin.
    Vec3 centre = Vec3::Zero();
    Box3 box;
    Mesh mesh;
    State state;

    Impl(const TriangleMesh& m, const Weights& w) : input(m), weights(w.volume, w.boundary, w.shape) {
        const Halfedges edges = connect(input);
        const std::size_t n = input.vertices.size();
        box = bounding_box(input);
        if (n > 0) centre = 0.5 * box.min + 0.5 * box.max;
        mesh = build(input, edges, centre);
        state.mesh = &mesh;
        state.vertices = mesh.number_of_vertices();
        state.side = {box.min.x() - centre.x(), box.max.x() - centre.x(), box.min.y() - centre.y(),
                      box.max.y() - centre.y()};
        state.boundary.assign(n, 0);
        state.sides.assign(n, 0);
        state.feature.assign(n, 0);
        state.region.assign(n, 0);
        state.frozen = material_borders(input);
        if (const Attribute* fixed = input.vertex_attribute("fixed"))
            for (std::size_t v = 0; v < std::min(n, fixed->values.size()); ++v)
                if (fixed->values[v] != 0.0) state.frozen[v] = 1;
        state.source.resize(n);
        for (std::uint32_t v = 0; v < n; ++v) state.source[v] = v;
        find_boundary();
    }

    void find_boundary() {
        std::array<double, 3> low{-kInfinity, -kInfinity, -kInfinity}, high{kInfinity, kInfinity, kInfinity};
        for (const Halfedge h : mesh.halfedges()) {
            if (!mesh.is_border(h)) continue;
            const Vertex a = mesh.source(h), b = mesh.target(h);
            for (const Vertex v : {a, b}) {
                const Vec3& p = input.vertices[v];
                state.boundary[v] = 1;
                state.sides[v] = static_cast<std::uint8_t>(
                    (p.x() == box.min.x()) * kMinX + (p.x() == box.max.x()) * kMaxX +
                    (p.y() == box.min.y()) * kMinY + (p.y() == box.max.y()) * kMaxY);
            }
            const int common = state.sides[a] & state.sides[b];
            for (std::size_t axis : {0, 1}) {
                if (common & (kMinX << 2 * axis)) low[axis] = state.side[2 * axis];
                if (common & (kMaxX << 2 * axis)) high[axis] = state.side[2 * axis + 1];
            }
        }
        state.low = {low[0], low[1], low[2]};
        state.high = {high[0], high[1], high[2]};
    }

    double edge_length(Mesh::Edge_index e) const {
        return std::sqrt(
            CGAL::squared_distance(mesh.point(mesh.vertex(e, 0)), mesh.point(mesh.vertex(e, 1))));
    }
};

CollapseEngine::CollapseEngine(const TriangleMesh& mesh, const Weights& weights)
    : impl_(std::make_unique<Impl>(mesh, weights)) {}
CollapseEngine::~CollapseEngine() = default;

void CollapseEngine::set_features(std::span<const std::uint8_t> features) {
    const std::size_t n = impl_->input.vertices.size();
    if (features.size() != n)
        throw GeometryError(
            fmt::format("{} feature flags for {} vertices: give one a vertex", features.size(), n));
    for (std::size_t v = 0; v < n; ++v) impl_->state.feature[v] = features[v] != 0;
    reset_region();
}

void CollapseEngine::reset_region() {
    impl_->state.region = impl_->state.feature;
}

std::size_t CollapseEngine::grow_region() {
    const std::vector<std::uint8_t> before = impl_->state.region;
    std::vector<std::uint8_t>& region = impl_->state.region;
    std::size_t added = 0;
    for (const Mesh::Edge_index e : impl_->mesh.edges()) {
        const Vertex a = impl_->mesh.vertex(e, 0), b = impl_->mesh.vertex(e, 1);
        if (before[a] == before[b]) continue;
        const Vertex joins = before[a] ? b : a;
        added += !region[joins];
        region[joins] = 1;
    }
    return added;
}

std::size_t CollapseEngine::run(const CollapsePass& pass) {
    State& state = impl_->state;
    const std::size_t before = state.vertices;
    state.pass = pass;
    if (state.vertices <= pass.target_vertices) return 0;
    const auto& weights = impl_->weights;
    sms::edge_collapse(impl_->mesh, Stop{&state},
                       CGAL::parameters::get_cost(sms::LindstromTurk_cost<Mesh>(weights))
                           .get_placement(Placement{&state, sms::LindstromTurk_placement<Mesh>(weights)})
                           .filter(ShapeFilter{&state})
                           .edge_is_constrained_map(UntouchableZeroEdges{&state})
                           .visitor(Visitor(&state)));
    return before - state.vertices;
}

std::size_t CollapseEngine::vertex_count() const {
    return impl_->state.vertices;
}

double CollapseEngine::shortest_transition_edge() const {
    double shortest = kInfinity;
    for (const Mesh::Edge_index e : impl_->mesh.edges())
        if (impl_->state.transition_edge(impl_->mesh.vertex(e, 0), impl_->mesh.vertex(e, 1)))
            shortest = std::min(shortest, impl_->edge_length(e));
    return shortest;
}

double CollapseEngine::longest_transition_edge() const {
    double longest = 0.0;
    for (const Mesh::Edge_index e : impl_->mesh.edges())
        if (impl_->state.transition_edge(impl_->mesh.vertex(e, 0), impl_->mesh.vertex(e, 1)))
            longest = std::max(longest, impl_->edge_length(e));
    return longest;
}

TriangleMesh CollapseEngine::take_mesh() const {
    const Mesh& mesh = impl_->mesh;
    const State& state = impl_->state;
    TriangleMesh result;
    result.vertices.reserve(mesh.number_of_vertices());
    result.triangles.reserve(mesh.number_of_faces());
    std::vector<std::uint32_t> renamed(impl_->input.vertices.size(), 0);
    for (const Vertex v : mesh.vertices()) {
        renamed[v] = static_cast<std::uint32_t>(result.vertices.size());
        if (state.source[v] != kMoved) {
            result.vertices.push_back(impl_->input.vertices[state.source[v]]);
            continue;
        }
        const Point& p = mesh.point(v);
        Vec3 position = Vec3(p.x(), p.y(), p.z()) + impl_->centre;
        // Adding the centre back rounds; the side planes must not.
        if (state.sides[v] & kMinX) position.x() = impl_->box.min.x();
        if (state.sides[v] & kMaxX) position.x() = impl_->box.max.x();
        if (state.sides[v] & kMinY) position.y() = impl_->box.min.y();
        if (state.sides[v] & kMaxY) position.y() = impl_->box.max.y();
        result.vertices.push_back(position);
    }
    const Attribute* material = impl_->input.triangle_attribute("material");
    if (material) result.triangle_attributes.push_back({material->name, 1, material->type, {}});
    for (const Mesh::Face_index f : mesh.faces()) {
        const Halfedge h = mesh.halfedge(f);
        result.triangles.push_back(
            {renamed[mesh.source(h)], renamed[mesh.target(h)], renamed[mesh.target(mesh.next(h))]});
        if (material) result.triangle_attributes[0].values.push_back(material->values[f]);
    }
    return result;
}

}  // namespace sidewall::simplify
