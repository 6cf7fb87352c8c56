#include "levelset/pieces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "surface/disjoint_sets.hpp"

namespace sidewall::levelset {
namespace {

// A vertex on a periodic side by where it is along that side.
struct SideVertex {
    long long along, z;
    std::uint32_t vertex;
    auto place() const { return std::tie(along, z); }
    bool operator<(const SideVertex& o) const { return place() < o.place(); }
};

std::vector<SideVertex> on_side(const TriangleMesh& surface, int axis, double side, double unit) {
    std::vector<SideVertex> list;
    for (std::uint32_t v = 0; v < surface.vertices.size(); ++v) {
        const Vec3& p = surface.vertices[v];
        if (p[axis] == side)
            list.push_back({std::llround(p[1 - axis] / unit), std::llround(p.z() / unit), v});
    }
    std::sort(list.begin(), list.end());
    return list;
}

surface::DisjointSets connected(const TriangleMesh& surface) {
    surface::DisjointSets sets(surface.vertices.size());
    for (const auto& [a, b, c] : surface.triangles) {
        sets.join(a, b);
        sets.join(b, c);
    }
    return sets;
}

// What lies on one periodic side repeats what lies on the other.
void join_across_sides(const TriangleMesh& surface, const Domain& domain, surface::DisjointSets& sets) {
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (domain.side[a] != Side::periodic) continue;
        const double unit = 1e-5 * domain.spacing;
        const auto low = on_side(surface, axis, domain.min[a], unit),
                   high = on_side(surface, axis, domain.max[a], unit);
        auto from = low.begin();
        for (const SideVertex& v : high) {
            while (from != low.end() && *from < v) ++from;
            if (from != low.end() && from->place() == v.place()) sets.join(from->vertex, v.vertex);
        }
    }
}

std::vector<std::uint32_t> roots(surface::DisjointSets& sets, std::size_t count) {
    std::vector<std::uint32_t> root(count);
    for (std::uint32_t v = 0; v < count; ++v) root[v] = sets.root(v);
    return root;
}

}  // namespace

std::vector<std::uint32_t> piece_of_vertices(const TriangleMesh& surface, const Domain& domain) {
    surface::DisjointSets sets = connected(surface);
    join_across_sides(surface, domain, sets);
    return roots(sets, surface.vertices.size());
}

std::vector<SurfacePiece> surface_pieces(const TriangleMesh& surface, const Domain& domain) {
    const std::size_t count = surface.vertices.size();
    surface::DisjointSets sets = connected(surface);
    const std::vector<std::uint32_t> within = roots(sets, count);  // the sides
    join_across_sides(surface, domain, sets);
    const std::vector<std::uint32_t> part = roots(sets, count);
    constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> number(count, kNone),
        box(count, kNone);  // by part, and by part within the sides
    std::vector<SurfacePiece> pieces;
    for (const Triangle& t : surface.triangles) {
        const std::uint32_t p = part[t[0]], inner = within[t[0]];
        if (number[p] == kNone) {
            number[p] = static_cast<std::uint32_t>(pieces.size());
            pieces.push_back({0, 0.0, p, p, {}});
        }
        if (box[inner] != kNone) continue;
        std::vector<Box3>& boxes = pieces[number[p]].boxes;
        box[inner] = static_cast<std::uint32_t>(boxes.size());
        boxes.emplace_back();
    }
    for (std::uint32_t v = 0; v < count; ++v) {
        if (number[part[v]] == kNone) continue;  // in no triangle
        SurfacePiece& piece = pieces[number[part[v]]];
        const Vec3& p = surface.vertices[v];
        piece.boxes[box[within[v]]].extend(p);
        if (p.z() > surface.vertices[piece.top].z()) piece.top = v;
    }
    std::vector<double> covered(pieces.size(), 0.0);
    for (const auto& [a, b, c] : surface.triangles) {
        const std::uint32_t n = number[part[a]];
        const Vec3 &x = surface.vertices[a], u = surface.vertices[b] - x, v = surface.vertices[c] - x;
        const double up = 0.5 * (u.x() * v.y() - u.y() * v.x());
        // Sides are vertical: only up and down count. From a vertex of the piece, so that small ones keep
        // their digits.
        const double height = x.z() + (u.z() + v.z()) / 3.0 - surface.vertices[pieces[n].part].z();
        covered[n] += up;
        pieces[n].volume += up * height;
    }
    const double area = (domain.max[0] - domain.min[0]) * (domain.max[1] - domain.min[1]);
    for (std::size_t n = 0; n < pieces.size(); ++n) {
        pieces[n].cover = static_cast<int>(std::lround(covered[n] / area));
        if (pieces[n].cover != 0) pieces[n].volume = 0.0;
    }
    return pieces;
}

}  // namespace sidewall::levelset
