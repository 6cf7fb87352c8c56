#pragma once
// Private to the CGAL engine: what steers its edge collapse. Include from collapse.cpp only.
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Edge_collapse_visitor_base.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk.h>

#include <algorithm>
#include <array>
#include <boost/optional.hpp>
#include <cmath>
#include <cstdint>
#include <vector>

#include "simplify/collapse.hpp"

namespace sidewall::simplify::cgal {

namespace sms = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Vector = Kernel::Vector_3;
using Mesh = CGAL::Surface_mesh<Point>;
using Vertex = Mesh::Vertex_index;

inline constexpr std::uint32_t kMoved = 0xffffffffu;

/// Side planes a boundary vertex lies in.
enum SideBit : std::uint8_t { kMinX = 1, kMaxX = 2, kMinY = 4, kMaxY = 8 };

/// What the policies share, by vertex index. A merged vertex inherits from both.
struct State {
    const Mesh* mesh = nullptr;
    CollapsePass pass;
    std::size_t vertices = 0;      ///< left
    std::array<double, 4> side{};  ///< x min, x max, y min, y max
    Vector low, high;  ///< no vertex goes beyond: side planes that hold boundary edges, or infinity
    std::vector<std::uint8_t> boundary;  ///< lies on the open boundary
    std::vector<std::uint8_t> sides;     ///< SideBits, of boundary vertices
    std::vector<std::uint8_t> frozen;    ///< on a material border, or fixed by the caller
    std::vector<std::uint8_t> feature, region;
    std::vector<std::uint32_t> source;  ///< input vertex whose position it has, or kMoved
    std::uint32_t next_source = kMoved;

    bool frozen_edge(Vertex a, Vertex b) const { return frozen[a] || frozen[b]; }
    bool transition_edge(Vertex a, Vertex b) const { return !region[a] && !region[b] && !frozen_edge(a, b); }
    /// Neither end pins the other to another place: one's side planes include the other's.
    bool boundary_allows(Vertex a, Vertex b, bool border_edge) const {
        if (!boundary[a] || !boundary[b]) return true;
        const int common = sides[a] & sides[b];
        return border_edge && (common == sides[a] || common == sides[b]);
    }
    bool allows(Vertex a, Vertex b, const Point& p, const Point& q, bool border_edge) const {
        return (pass.spare_region ? transition_edge(a, b) : !frozen_edge(a, b)) &&
               boundary_allows(a, b, border_edge) &&
               CGAL::squared_distance(p, q) < pass.max_length * pass.max_length;
    }
};

inline bool is_corner(std::uint8_t sides) {
    return (sides & (kMinX | kMaxX)) && (sides & (kMinY | kMaxY));
}

/// Lindstrom-Turk's placement, held to the boundary and to the neighbourhood; none for edges the pass leaves
/// alone.
struct Placement {
    const State* state;
    sms::LindstromTurk_placement<Mesh> lindstrom_turk;

    template <class Profile>
    boost::optional<Point> operator()(const Profile& edge) const {
        const Vertex a = edge.v0(), b = edge.v1();
        const bool border = edge.is_v0_v1_a_border() || edge.is_v1_v0_a_border();
        if (!state->allows(a, b, edge.p0(), edge.p1(), border)) return boost::none;
        if (edge.p0() == edge.p1()) return edge.p0();
        const std::uint8_t sides_a = state->sides[a], sides_b = state->sides[b];
        if (state->boundary[a] != state->boundary[b]) return state->boundary[a] ? edge.p0() : edge.p1();
        if (sides_a != sides_b) return (sides_a & sides_b) == sides_b ? edge.p0() : edge.p1();
        if (is_corner(sides_a)) return edge.p0();
        boost::optional<Point> place = lindstrom_turk(edge);
        if (!place || !near(edge, *place)) place = CGAL::midpoint(edge.p0(), edge.p1());
        return snapped(*place, sides_a);
    }

    Point snapped(const Point& p, std::uint8_t sides) const {
        const double x = sides & kMinX ? state->side[0] : sides & kMaxX ? state->side[1] : p.x();
        const double y = sides & kMinY ? state->side[2] : sides & kMaxY ? state->side[3] : p.y();
        return {x, y, p.z()};
    }

    /// Within the box of the surrounding vertices; half an edge more, since on a curved surface the point
    /// that keeps the volume lies above them all.
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
    // Height over longest edge, 3 degrees in a thin triangle. The worst triangle around an edge may not sink
    // below this, or below what it was: comparing triangle by triangle would protect the slivers that are
    // there.
    static constexpr double kMinHeight = 0.05;

    const State* state;

    template <class Profile>
    boost::optional<Point> operator()(const Profile& edge, const boost::optional<Point>& place) const {
        if (!place) return boost::none;
        const std::size_t vanishing =
            std::size_t{edge.left_face_exists()} + std::size_t{edge.right_face_exists()};
        double worst_before = kMinHeight, worst_after = kMinHeight;
        for (std::size_t i = 0; i < edge.triangles().size(); ++i) {
            const auto& t = edge.triangles()[i];
            const Point &p = state->mesh->point(t.v0), &q = state->mesh->point(t.v2);
            const Shape before = shape(p, state->mesh->point(t.v1), q);
            worst_before = std::min(worst_before, before.height);
            if (i < vanishing) continue;
            // The second vertex of every triangle that stays is the one that moves.
            const Shape after = shape(p, *place, q);
            worst_after = std::min(worst_after, after.height);
            if (!(after.height > 0.0)) return boost::none;
            if (before.height > 0.0 && !(before.normal * after.normal > 0.0)) return boost::none;
        }
        if (worst_after < worst_before) return boost::none;
        return place;
    }

    struct Shape {
        Vector normal;
        double height;  ///< over the longest edge
    };
    static Shape shape(const Point& a, const Point& b, const Point& c) {
        const Vector u = b - a, v = c - a, w = c - b;
        const Vector normal = CGAL::cross_product(u, v);
        const double longest = std::max({u * u, v * v, w * w});
        return {normal, longest > 0.0 ? std::sqrt(normal * normal) / longest : 0.0};
    }
};

struct Stop {
    const State* state;
    template <class Profile>
    bool operator()(double, const Profile&, std::size_t, std::size_t) const {
        return state->vertices <= state->pass.target_vertices;
    }
};

/// Hands the flags of both ends to the vertex that is kept.
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
        for (auto* flags : {&state->boundary, &state->sides, &state->frozen, &state->feature, &state->region})
            (*flags)[kept] |= (*flags)[gone];
        state->source[kept] = state->next_source;
        --state->vertices;
    }
};

/// CGAL collapses edges of no length unasked; those the pass must leave alone are declared constrained.
struct UntouchableZeroEdges {
    using key_type = Mesh::Edge_index;
    using value_type = bool;
    using reference = bool;
    using category = boost::readable_property_map_tag;
    const State* state;
    friend bool get(const UntouchableZeroEdges& map, key_type edge) {
        const State& s = *map.state;
        const Vertex a = s.mesh->vertex(edge, 0), b = s.mesh->vertex(edge, 1);
        const Point &p = s.mesh->point(a), &q = s.mesh->point(b);
        return p == q &&
               (s.vertices <= s.pass.target_vertices || !s.allows(a, b, p, q, s.mesh->is_border(edge)));
    }
};

}  // namespace sidewall::simplify::cgal
