#include "simplify/cgal_lindstrom_turk.hpp"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Edge_collapse_visitor_base.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "simplify/collapse_mesh.hpp"
#include "simplify/vertex_kind.hpp"

namespace sidewall::simplify {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Vertex = Mesh::Vertex_index;
// boost::optional before CGAL 6, std::optional since.
using MaybePoint =
    decltype(std::declval<sms::LindstromTurk_placement<Mesh>>()(std::declval<sms::Edge_profile<Mesh>>()));

constexpr std::uint32_t kMoved = 0xffffffffu;

/// State shared by the policies; arrays are by vertex index.
struct State {
    const Mesh* mesh = nullptr;
    double max_length = 0.0;   ///< only shorter edges collapse
    std::size_t target = 0;    ///< stops when no more vertices than this are left
    std::size_t vertices = 0;  ///< vertices left
    Vec3 box_min, box_max;     ///< bounding box of the input, relative to its centre
    Vector low, high;          ///< bounds on placements: side planes that hold boundary edges, or infinity
    std::vector<VertexConstraint> constraint;
    std::vector<std::uint8_t> crowded;  ///< whether it has too many triangles for its edges to collapse
    std::vector<std::uint32_t> source;  ///< input vertex whose position it has, or kMoved
    std::uint32_t next_source = kMoved;

    /// The place that an edge may collapse to; `nowhere` if it is too long.
    MergedPlace place(Vertex a, Vertex b, const Point& p, const Point& q, bool boundary_edge) const {
        if (!(CGAL::squared_distance(p, q) < max_length * max_length)) return MergedPlace::nowhere;
        return merged_place(constraint[a], constraint[b], boundary_edge);
    }
};

/// Lindstrom-Turk's placement under the boundary's constraints, or the midpoint if that is far away; none for
/// edges that must not collapse.
struct Placement {
    const State* state;
    sms::LindstromTurk_placement<Mesh> lindstrom_turk;

    template <class Profile>
    MaybePoint operator()(const Profile& edge) const {
        const Vertex a = edge.v0(), b = edge.v1();
        const bool boundary_edge = edge.is_v0_v1_a_border() || edge.is_v1_v0_a_border();
        const MergedPlace where = state->place(a, b, edge.p0(), edge.p1(), boundary_edge);
        if (where == MergedPlace::nowhere) return {};
        if (where == MergedPlace::start || edge.p0() == edge.p1()) return edge.p0();
        if (where == MergedPlace::end) return edge.p1();
        MaybePoint place = lindstrom_turk(edge);
        if (!place || !near(edge, *place)) place = CGAL::midpoint(edge.p0(), edge.p1());
        // On the boundary both ends lie in the same side planes, elsewhere in none.
        Vec3 p(place->x(), place->y(), place->z());
        move_into(state->constraint[a].planes, p, state->box_min, state->box_max);
        return Point(p.x(), p.y(), p.z());
    }

    /// Whether \p p lies in the bounding box of the surrounding vertices, enlarged by half an edge: on a
    /// curved surface the point that keeps the volume lies outside of the box itself.
    template <class Profile>
    bool near(const Profile& edge, const Point& p) const {
        CGAL::Bbox_3 box = edge.p0().bbox() + edge.p1().bbox();
        for (const Vertex v : edge.link()) box += state->mesh->point(v).bbox();
        const double margin = 0.5 * std::sqrt(CGAL::squared_distance(edge.p0(), edge.p1()));
        for (int axis = 0; axis < 3; ++axis)
            if (!(p[axis] >= std::max(box.min(axis) - margin, state->low[axis]) &&
                  p[axis] <= std::min(box.max(axis) + margin, state->high[axis])))
                return false;
        return true;
    }
};

/// Refuses a collapse that flips a triangle or makes a sliver of it.
struct ShapeFilter {
    // Height over longest edge, 3 degrees in a thin triangle. A collapse may not lower the least value around
    // its edge below this, or further if it is below. A test of each triangle would protect old slivers.
    static constexpr double kMinHeight = 0.05;

    const State* state;

    template <class Profile>
    MaybePoint operator()(const Profile& edge, const MaybePoint& place) const {
        if (!place) return {};
        const std::size_t vanishing =
            std::size_t{edge.left_face_exists()} + std::size_t{edge.right_face_exists()};
        double worst_before = kMinHeight, worst_after = kMinHeight;
        for (std::size_t i = 0; i < edge.triangles().size(); ++i) {
            const auto& t = edge.triangles()[i];
            const Point &p = state->mesh->point(t.v0), &q = state->mesh->point(t.v2);
            const Shape before = shape(p, state->mesh->point(t.v1), q);
            worst_before = std::min(worst_before, before.height);
            if (i < vanishing) continue;
            // v1 of every triangle that stays is the vertex that moves.
            const Shape after = shape(p, *place, q);
            worst_after = std::min(worst_after, after.height);
            if (!(after.height > 0.0)) return {};
            if (before.height > 0.0 && !(before.normal * after.normal > 0.0)) return {};
        }
        if (worst_after < worst_before) return {};
        return place;
    }

    struct Shape {
        Vector normal;
        double height;  ///< divided by the longest edge
    };
    static Shape shape(const Point& a, const Point& b, const Point& c) {
        const Vector u = b - a, v = c - a, w = c - b;
        const Vector normal = CGAL::cross_product(u, v);
        const double longest = std::max({u * u, v * v, w * w});
        return {normal, longest > 0.0 ? std::sqrt(normal * normal) / longest : 0.0};
    }
};

/// Stops at the vertex target.
struct Stop {
    const State* state;
    template <class Profile>
    bool operator()(double, const Profile&, std::size_t, std::size_t) const {
        return state->vertices <= state->target;
    }
};

/// Updates constraints, sources and the vertex count at each collapse.
struct Visitor : sms::Edge_collapse_visitor_base<Mesh> {
    State* state;
    explicit Visitor(State* s) : state(s) {}

    template <class Profile, class Place>
    void OnCollapsing(const Profile& edge, const Place& place) const {
        state->next_source = *place == edge.p0()   ? state->source[edge.v0()]
                             : *place == edge.p1() ? state->source[edge.v1()]
                                                   : kMoved;
    }
    template <class Profile>
    void OnCollapsed(const Profile& edge, Vertex kept) const {
        const Vertex gone = kept == edge.v0() ? edge.v1() : edge.v0();
        state->constraint[kept] = merged(state->constraint[kept], state->constraint[gone]);
        state->source[kept] = state->next_source;
        --state->vertices;
    }
};

/// Edges that CGAL must not collapse: those of crowded vertices, and zero-length edges to which Placement or
/// Stop would object, because CGAL collapses these without asking.
struct UntouchableEdges {
    using key_type = Mesh::Edge_index;
    using value_type = bool;
    using reference = bool;
    using category = boost::readable_property_map_tag;
    const State* state;
    friend bool get(const UntouchableEdges& map, key_type edge) {
        const State& s = *map.state;
        const Vertex a = s.mesh->vertex(edge, 0), b = s.mesh->vertex(edge, 1);
        if (s.crowded[a] || s.crowded[b]) return true;
        const Point &p = s.mesh->point(a), &q = s.mesh->point(b);
        return p == q && (s.vertices <= s.target ||
                          s.place(a, b, p, q, s.mesh->is_border(edge)) == MergedPlace::nowhere);
    }
};

using Halfedge = Mesh::Halfedge_index;

/// Makes CGAL's half-edge mesh by hand: its add_face searches and depends on the order of triangles.
Mesh build(const TriangleMesh& input, const Vec3& centre) {
    const std::vector<std::uint32_t> opposite = opposite_halfedges(input);
    const auto halfedges = static_cast<std::uint32_t>(opposite.size());
    Mesh mesh;
    mesh.reserve(static_cast<Mesh::size_type>(input.vertices.size()), halfedges / 2 + halfedges / 8,
                 halfedges / 3);
    for (const Vec3& v : input.vertices) {
        const Vec3 p = v - centre;
        mesh.add_vertex(Point(p.x(), p.y(), p.z()));
    }
    std::vector<Halfedge> ours(halfedges), border_out(input.vertices.size());
    for (std::uint32_t h = 0; h < halfedges; ++h) {
        const std::uint32_t other = opposite[h];
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

/// The mesh in CGAL's structure and the state that the policies read.
struct Engine {
    const TriangleMesh& input;
    sms::internal::LindstromTurk_params weights;
    // Positions are relative to the centre: far from the origin the cost's determinants cancel badly.
    Vec3 centre = Vec3::Zero();
    Box3 box;
    Mesh mesh;
    State state;

    Engine(const TriangleMesh& m, const Weights& w, std::span<const std::uint8_t> fixed)
        : input(m), weights(w.volume, w.boundary, w.shape) {
        const std::size_t n = input.vertices.size();
        box = bounding_box(input);
        if (n > 0) centre = 0.5 * box.min + 0.5 * box.max;
        mesh = build(input, centre);
        state.mesh = &mesh;
        state.vertices = mesh.number_of_vertices();
        state.box_min = box.min - centre;
        state.box_max = box.max - centre;
        state.constraint.resize(n);
        find_boundary();
        std::vector<std::uint32_t> triangles(n, 0);
        for (const Triangle& t : input.triangles)
            for (const std::uint32_t v : t) ++triangles[v];
        // Most triangles at a vertex whose edges may collapse: CGAL visits them all at each collapse.
        constexpr std::uint32_t kCrowd = 1000;
        state.crowded.resize(n);
        for (std::size_t v = 0; v < n; ++v) state.crowded[v] = triangles[v] > kCrowd;
        const std::vector<std::uint8_t> frozen = frozen_vertices(input, fixed);
        for (std::size_t v = 0; v < n; ++v)
            if (frozen[v]) state.constraint[v].kind = VertexKind::frozen;
        state.source.resize(n);
        for (std::uint32_t v = 0; v < n; ++v) state.source[v] = v;
    }

    void find_boundary() {
        std::array<double, 3> low{-kInfinity, -kInfinity, -kInfinity}, high{kInfinity, kInfinity, kInfinity};
        for (const Halfedge h : mesh.halfedges()) {
            if (!mesh.is_border(h)) continue;
            const Vertex a = mesh.source(h), b = mesh.target(h);
            for (const Vertex v : {a, b}) state.constraint[v] = boundary_constraint(input.vertices[v], box);
            const int common = state.constraint[a].planes & state.constraint[b].planes;
            if (common & kMinX) low[0] = state.box_min.x();
            if (common & kMaxX) high[0] = state.box_max.x();
            if (common & kMinY) low[1] = state.box_min.y();
            if (common & kMaxY) high[1] = state.box_max.y();
        }
        state.low = {low[0], low[1], low[2]};
        state.high = {high[0], high[1], high[2]};
    }

    void run(double max_length, std::size_t target) {
        state.max_length = max_length;
        state.target = target;
        if (state.vertices <= target) return;
        sms::edge_collapse(mesh, Stop{&state},
                           CGAL::parameters::get_cost(sms::LindstromTurk_cost<Mesh>(weights))
                               .get_placement(Placement{&state, sms::LindstromTurk_placement<Mesh>(weights)})
                               .filter(ShapeFilter{&state})
                               .edge_is_constrained_map(UntouchableEdges{&state})
                               .visitor(Visitor(&state)));
    }

    TriangleMesh take_mesh() const {
        std::vector<std::uint32_t> corner(3 * input.triangles.size(), kNoHalfedge);
        for (const Mesh::Face_index f : mesh.faces()) {
            Halfedge h = mesh.halfedge(f);
            for (std::size_t k = 0; k < 3; ++k, h = mesh.next(h)) corner[3 * f + k] = mesh.source(h);
        }
        return assemble(input, corner, [&](std::uint32_t v) {
            if (state.source[v] != kMoved) return input.vertices[state.source[v]];
            const Point& p = mesh.point(Vertex(v));
            Vec3 position = Vec3(p.x(), p.y(), p.z()) + centre;
            // Adding the centre back rounds: put the vertex back into its side planes.
            move_into(state.constraint[v].planes, position, box.min, box.max);
            return position;
        });
    }
};

}  // namespace

Result simplify_cgal_lindstrom_turk(const TriangleMesh& mesh, const Options& options) {
    check(options, false);
    const double longest = options.l_max.value_or(kInfinity);
    Engine engine(mesh, options.weights.value_or(kVolumeWeights), options.fixed);
    const std::size_t before = engine.state.vertices;
    engine.run(longest, options.target_vertices.value_or(0));
    Result result;
    result.passes.push_back({longest, before - engine.state.vertices});
    result.mesh = engine.take_mesh();
    return result;
}

}  // namespace sidewall::simplify
