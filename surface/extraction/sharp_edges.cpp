#include "surface/extraction/sharp_edges.hpp"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <tuple>

#include "surface/extraction/fans.hpp"

namespace sidewall::surface {
namespace {

using openvdb::Coord;

constexpr double kBetterFit = 0.05;  // least gain of the worst cosine for which an edge is flipped

Vec3 world_point(const LateralGrid& box, const Fan& fan, const Vec3& local) {
    Vec3 p;
    for (int a = 0; a < 3; ++a) p[a] = node_coordinate(box, a, fan.of->cell[a]) + local[a] * box.spacing;
    return p;
}

// A segment of a fan's loop.
struct Segment {
    std::uint32_t low, high;  // its crossings
    std::uint32_t fan, of_loop;
};

// The face of a cell in which a segment lies, by its axis and side.
struct Face {
    int axis, side;
};

Face face_of(const Fan& fan, std::uint32_t segment) {
    const auto& loop = fan.of->loop;
    const int edges[] = {loop[segment].edge, loop[(segment + 1) % loop.size()].edge};
    for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side)
            if (std::all_of(std::begin(edges), std::end(edges), [&](int edge) {
                    return edge / 4 != axis && (edge_corner(edge) >> axis & 1) == side;
                }))
                return {axis, side};
    return {0, 0};
}

// Whether a face has two segments.
bool is_ambiguous(std::uint8_t pattern, const Face& face) {
    const int u = (face.axis + 1) % 3, v = (face.axis + 2) % 3;
    const auto in = [&](int i, int j) { return pattern >> (face.side << face.axis | i << u | j << v) & 1; };
    return in(0, 0) == in(1, 1) && in(1, 0) == in(0, 1) && in(0, 0) != in(1, 0);
}

// Cosine between a triangle's normal and a plane's; -1 for one without area.
double fit(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal) {
    const Vec3 n = (b - a).cross(c - a);
    const double length = n.norm();
    return length > 1e-12 ? n.dot(normal) / length : -1.0;
}

// Joins the apices of fans whose cells share a face, and apices beside a side of the domain with their
// images, if the triangles then fit the planes better.
class Joiner {
  public:
    Joiner(const LateralGrid& box, const Crossings& crossings, std::vector<Fan>& fans, TriangleMesh& mesh,
           SharpVertices& sharp)
        : box_(box), crossings_(crossings), fans_(fans), mesh_(mesh), sharp_(sharp) {}

    void join() {
        std::vector<Segment> segments;
        for (std::uint32_t f = 0; f < fans_.size(); ++f) {
            Fan& fan = fans_[f];
            const std::size_t count = fan.of->loop.size();
            fan.joined_to.assign(count, kNone);
            fan.split.assign(count, false);
            for (std::uint32_t k = 0; k < count; ++k) {
                const auto [low, high] =
                    std::minmax(fan.of->loop[k].crossing, fan.of->loop[(k + 1) % count].crossing);
                segments.push_back({low, high, f, k});
            }
        }
        tbb::parallel_sort(segments.begin(), segments.end(), [](const Segment& a, const Segment& b) {
            return std::tie(a.low, a.high, a.fan, a.of_loop) < std::tie(b.low, b.high, b.fan, b.of_loop);
        });
        for (auto s = segments.begin(); s != segments.end(); ++s) {
            const Fan& fan = fans_[s->fan];
            const Face face = face_of(fan, s->of_loop);
            if (is_ambiguous(fan.of->pattern, face)) continue;
            if (on_side(fan, face) && !box_.periodic[static_cast<std::size_t>(face.axis)]) {
                join_image(*s, face);
                continue;
            }
            for (auto t = s + 1; t != segments.end() && t->low == s->low && t->high == s->high; ++t)
                if (lie_across(*s, face, *t)) join_fans(*s, face, *t);
        }
    }

  private:
    bool on_side(const Fan& fan, const Face& face) const {
        return face.axis < 2 &&
               fan.of->cell[face.axis] ==
                   (face.side == 0 ? 0 : box_.cells[static_cast<std::size_t>(face.axis)] - 1);
    }
    // Whether a face is one of the two periodic sides of a profile of one cell.
    bool is_profile(const Face& face) const {
        const auto a = static_cast<std::size_t>(face.axis);
        return face.axis < 2 && box_.periodic[a] && box_.cells[a] == 1;
    }
    // Whether another segment is this one, seen from the cell across the face.
    bool lie_across(const Segment& own, const Face& face, const Segment& other) const {
        Coord beside = fans_[own.fan].of->cell;
        if (on_side(fans_[own.fan], face))
            beside[face.axis] = box_.cells[static_cast<std::size_t>(face.axis)] - 1 - beside[face.axis];
        else
            beside[face.axis] += 2 * face.side - 1;
        const Face across = face_of(fans_[other.fan], other.of_loop);
        return fans_[other.fan].of->cell == beside && across.axis == face.axis && across.side != face.side;
    }

    // The point where the line from a fan's apex to another passes through a face, if joining them fits
    // better than the segment there. It must pass through the face itself or, if \p beside, through the face
    // beside it between the cells that both fans have taken.
    std::optional<Vec3> joint(const Segment& segment, const Face& face, const Vec3& other,
                              bool beside) const {
        const Fan& fan = fans_[segment.fan];
        const auto& loop = fan.of->loop;
        const Corner &from = loop[segment.of_loop], &to = loop[(segment.of_loop + 1) % loop.size()];
        const CrossingPlane &first = crossings_.plane[from.crossing], &second = crossings_.plane[to.crossing];
        const Vec3 p = local_point(from, first), q = local_point(to, second);
        const Vec3 &own = fan.apex, &n = first.normal, &m = second.normal;
        const double before =
            std::min({fit(p, q, own, n), fit(p, q, own, m), fit(q, p, other, n), fit(q, p, other, m)});
        const double after = std::min(fit(own, p, other, n), fit(other, q, own, m));
        if (!is_profile(face) && !(after > before + kBetterFit)) return std::nullopt;
        const double t = (face.side - own[face.axis]) / (other[face.axis] - own[face.axis]);
        const Vec3 through = own + t * (other - own);
        for (int u = 0; u < 3 && !beside && !is_profile(face); ++u)
            if (u != face.axis && !(through[u] > 0.0 && through[u] < 1.0)) return std::nullopt;
        return through;
    }

    void join_fans(const Segment& own, const Face& face, const Segment& other) {
        Fan &fan = fans_[own.fan], &with = fans_[other.fan];
        Vec3 apex = with.apex;  // in this cell's frame
        apex[face.axis] += face.side == 0 ? -1.0 : 1.0;
        const bool beside = with.taken == fan.taken && fan.taken != std::array<int, 3>{};
        const auto through = joint(own, face, apex, beside);
        if (!through) return;
        if (!on_side(fan, face)) {
            fan.joined_to[own.of_loop] = sharp_.first + other.fan;
            with.joined_to[other.of_loop] = sharp_.first + own.fan;
            return;
        }
        if (is_profile(face) && own.fan == other.fan) return span(own, face, other, *through);
        split(own, face, *through);
        split(other, {face.axis, 1 - face.side}, *through);
    }
    // In a profile of one cell edges run from side to side: the apex goes onto one, a vertex onto the other.
    void span(const Segment& own, const Face& face, const Segment& other, const Vec3& through) {
        split(face.side == 1 ? own : other, {face.axis, 1}, through);
        Fan& fan = fans_[own.fan];
        const std::uint32_t apex = sharp_.first + own.fan;
        fan.joined_to[(face.side == 0 ? own : other).of_loop] = apex;
        Vec3& p = mesh_.vertices[apex];
        p = world_point(box_, fan, through);
        p[face.axis] = box_.min[static_cast<std::size_t>(face.axis)];
    }
    void join_image(const Segment& own, const Face& face) {
        Vec3 image = fans_[own.fan].apex;
        image[face.axis] = 2.0 * face.side - image[face.axis];
        if (const auto through = joint(own, face, image, false)) split(own, face, *through);
    }

    // Puts a vertex on a segment on a side of the domain.
    void split(const Segment& segment, const Face& face, const Vec3& through) {
        Fan& fan = fans_[segment.fan];
        Vec3 world = world_point(box_, fan, through);
        const auto a = static_cast<std::size_t>(face.axis);
        world[face.axis] = face.side == 0 ? box_.min[a] : box_.max[a];
        fan.joined_to[segment.of_loop] = static_cast<std::uint32_t>(mesh_.vertices.size());
        fan.split[segment.of_loop] = true;
        mesh_.vertices.push_back(world);
        sharp_.kind.push_back(fan.kind);
    }

    const LateralGrid& box_;
    const Crossings& crossings_;
    std::vector<Fan>& fans_;
    TriangleMesh& mesh_;
    SharpVertices& sharp_;
};

// Moves the crossings of fans, and those on an edge of the surface, to where their planes put them, with
// their images on the sides.
void move_vertices(const CutLeaves& leaves, const LateralGrid& box, const Crossings& crossings,
                   const std::vector<Fan>& fans, std::vector<Vec3>& vertices) {
    std::vector<std::uint8_t> moved(crossings.edge.size(), 0);
    for (const Fan& fan : fans)
        for (const Corner& c : fan.of->loop) moved[c.crossing] = 1;
    for (std::size_t n = 0; n < moved.size(); ++n) {
        if (moved[n] == 0 && !crossings.plane[n].on_edge) continue;
        const auto [low, axis] = crossings.edge[n];
        for (int image = 0; image < 4; ++image) {
            Coord at = low;
            bool is_image = true;
            for (int a = 0; a < 2; ++a) {
                const auto k = static_cast<std::size_t>(a);
                if ((image >> a & 1) == 0) continue;
                is_image = is_image && box.periodic[k] && low[a] == 0 && a != axis;
                at[a] = box.cells[k];
            }
            const std::uint32_t vertex = is_image ? leaves.vertex_on(at, axis) : kNoVertex;
            if (vertex != kNoVertex)
                vertices[vertex][axis] =
                    node_coordinate(box, axis, at[axis]) + crossings.plane[n].at * box.spacing;
        }
    }
}

// Writes the triangles of the fans over those that their cells had, and surplus ones at the end.
void write_fans(const std::vector<Fan>& fans, const SharpVertices& sharp, std::vector<Triangle>& triangles) {
    for (std::size_t f = 0; f < fans.size(); ++f) {
        const Fan& fan = fans[f];
        const auto apex = static_cast<std::uint32_t>(sharp.first + f);
        const std::size_t count = fan.of->loop.size();
        std::size_t free = count - 2, next = fan.of->first_triangle;
        const auto put = [&](const Triangle& t) {
            if (free > 0)
                triangles[next++] = t, --free;
            else
                triangles.push_back(t);
        };
        for (std::size_t k = 0; k < count; ++k) {
            const std::uint32_t from = fan.of->loop[k].vertex, to = fan.of->loop[(k + 1) % count].vertex;
            if (fan.joined_to[k] == kNone)
                put({from, to, apex});
            else if (fan.joined_to[k] != apex)
                put({apex, from, fan.joined_to[k]});
            if (fan.split[k]) put({apex, fan.joined_to[k], to});
        }
    }
}

}  // namespace

SharpVertices add_sharp_edges(const CutLeaves& leaves, const LateralGrid& box, SharpEdges which,
                              TriangleMesh& mesh) {
    std::vector<BentCell> cells = bent_cells(leaves, box);
    if (cells.empty()) return {leaves.vertices(), {}};
    const Crossings crossings = find_crossings(leaves, box, cells);
    std::vector<Fan> fans = find_fans(leaves, box, cells, crossings, which);
    SharpVertices sharp{static_cast<std::uint32_t>(mesh.vertices.size()), {}};
    for (const Fan& fan : fans) {
        mesh.vertices.push_back(world_point(box, fan, fan.apex));
        sharp.kind.push_back(fan.kind);
    }
    Joiner(box, crossings, fans, mesh, sharp).join();
    move_vertices(leaves, box, crossings, fans, mesh.vertices);
    write_fans(fans, sharp, mesh.triangles);
    return sharp;
}

}  // namespace sidewall::surface
