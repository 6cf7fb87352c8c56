#include "simplify/edge_collapse.hpp"

#include <algorithm>
#include <tuple>

namespace sidewall::simplify {
namespace {

// sin^2 of 5 degrees: a triangle with a smaller angle is a sliver. A collapse may not lower the least angle
// around its edge below this, or further if it is below. A test of each triangle would protect slivers.
constexpr double kSliver = 0.0871557 * 0.0871557;

// Cosine between the normals of neighbours below which the surface folds back on itself. To within rounding,
// such sheets touch or cross, and a particle slips through.
constexpr double kFold = -0.8;

/// Whether any two neighbours among the moved triangles from \p first to \p last form a fold.
bool folds(const Surroundings& s, std::size_t first, std::size_t last, Vec3 Change::*normal) {
    for (std::size_t i = first; i < last; ++i)
        for (std::size_t j = first; j < last; ++j) {
            if (s.moved[i].w != s.moved[j].u) continue;
            const Vec3 &m = s.changes[i].*normal, &n = s.changes[j].*normal;
            const double c = m.dot(n);
            if (c < 0.0 && c * c > kFold * kFold * m.squaredNorm() * n.squaredNorm()) return true;
        }
    return false;
}

/// sin^2 of a triangle's least angle, between its two longer edges. \p normal is twice its area vector.
double least_angle(const Vec3& normal, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
    const double longer = std::max({ab * bc, bc * ca, ca * ab});
    return longer > 0.0 ? normal.squaredNorm() / longer : 0.0;
}

/// Whether the least angle around an edge is at most \p angle (as sin^2) before the collapse.
bool as_sharp_now(const CollapseMesh& mesh, std::uint32_t v0, std::uint32_t v1, const Surroundings& s,
                  double angle) {
    for (const auto& [v, ring] : {std::pair{v0, &s.start}, {v1, &s.end}})
        for (std::uint32_t i = 0; i < ring->triangles; ++i) {
            const Vec3 &from = mesh.position(v), &p = mesh.position(ring->neighbours[i]),
                       &q = mesh.position(ring->neighbours[i + 1 < ring->size ? i + 1 : 0]);
            if (least_angle((p - from).cross(q - from), from, p, q) <= angle) return true;
        }
    return false;
}

/// Tests shape, orientation and side planes of the triangles that stay. Fills in `moved` and `changes`.
bool keeps_shape(const CollapseMesh& mesh, std::uint32_t v0, std::uint32_t v1, const Vec3& place,
                 Surroundings& s) {
    double worst = kSliver;
    std::size_t at_start = 0;
    const int planes = mesh.state[v0].constraint.planes | mesh.state[v1].constraint.planes;
    s.count = 0;
    for (const auto& [v, other, ring] : {std::tuple{v0, v1, &s.start}, {v1, v0, &s.end}}) {
        const Vec3& from = mesh.position(v);
        for (std::uint32_t i = 0; i < ring->triangles; ++i) {
            const std::uint32_t u = ring->neighbours[i], w = ring->neighbours[i + 1 < ring->size ? i + 1 : 0];
            if (u == other || w == other) continue;
            // A triangle in a side plane would close off the side; no particle arrives there.
            if (const int side = mesh.state[u].constraint.planes & mesh.state[w].constraint.planes & planes;
                side != 0 && (side & mesh.state[v].constraint.planes) == 0)
                return false;
            const Vec3 &p = mesh.position(u), &q = mesh.position(w);
            const Vec3 before = (p - from).cross(q - from), after = (p - place).cross(q - place);
            const double angle = least_angle(after, place, p, q);
            worst = std::min(worst, angle);
            if (!(angle > 0.0)) return false;
            if (!(before.dot(after) > 0.0) && before.squaredNorm() > 0.0) return false;
            s.moved[s.count] = {ring->out[i] / 3, u, w};
            s.changes[s.count++] = {before, after};
        }
        if (v == v0) at_start = s.count;
    }
    if (folds(s, 0, s.count, &Change::after) && !folds(s, 0, at_start, &Change::before) &&
        !folds(s, at_start, s.count, &Change::before))
        return false;
    return worst >= kSliver || as_sharp_now(mesh, v0, v1, s, worst);
}

}  // namespace

bool can_collapse(const CollapseMesh& mesh, std::uint32_t h, const Vec3& place, Surroundings& s) {
    const std::uint32_t v0 = mesh.start(h), v1 = mesh.end(h);
    mesh.ring(v0, s.start);
    mesh.ring(v1, s.end);
    s.apexes = 0;
    for (const std::uint32_t side : {h, mesh.opposite[h]}) {
        if (side == kNoHalfedge) continue;
        const std::uint32_t c = mesh.corner[CollapseMesh::previous(side)];
        if (!mesh.flagged(c, kBoundary) && mesh.state[c].degree <= 3) return false;
        if (mesh.opposite[CollapseMesh::next(side)] == kNoHalfedge &&
            mesh.opposite[CollapseMesh::previous(side)] == kNoHalfedge)
            return false;
        s.gone[s.apexes] = side / 3;
        s.apex[s.apexes++] = c;
    }
    const std::size_t degree = s.start.size + s.end.size - 2 - s.apexes;
    const bool boundary = mesh.flagged(v0, kBoundary) || mesh.flagged(v1, kBoundary);
    if (degree > OneRing::kMost || degree < (boundary ? 2u : 3u)) return false;
    std::size_t common = 0;
    for (std::uint32_t i = 0; i < s.end.size; ++i)
        for (std::uint32_t j = 0; j < s.start.size; ++j)
            common += s.end.neighbours[i] == s.start.neighbours[j];
    return common == s.apexes && keeps_shape(mesh, v0, v1, place, s);
}

void collapse_edge(CollapseMesh& mesh, std::uint32_t h, const Vec3& place, const Surroundings& s) {
    const std::uint32_t v0 = mesh.start(h), v1 = mesh.end(h);
    const Vec3 from_v0 = mesh.position(v0), from_v1 = mesh.position(v1);
    VertexSums sums{place, {}, Vec3::Zero(), Vec3::Zero(), 0.0};
    for (std::size_t i = 0; i < s.count; ++i) {
        const Change& c = s.changes[i];
        for (const std::uint32_t r : {s.moved[i].u, s.moved[i].w}) {
            mesh.sums[r].planes.add_outer(c.after, 1.0);
            mesh.sums[r].planes.add_outer(c.before, -1.0);
            mesh.sums[r].normal += c.after - c.before;
        }
        sums.planes.add_outer(c.after, 1.0);
        sums.normal += c.after;
    }
    for (std::size_t i = 0; i < s.apexes; ++i) {
        VertexSums& apex = mesh.sums[s.apex[i]];
        const Vec3 gone = (from_v0 - apex.position).cross(from_v1 - apex.position);
        apex.planes.add_outer(gone, -1.0);
        apex.normal -= (i == 0 ? 1.0 : -1.0) * gone;
    }
    const auto relink = [&](const OneRing& ring, std::uint32_t other, const Vec3& from, bool twice) {
        for (std::uint32_t i = 0; i < ring.size; ++i) {
            const std::uint32_t r = ring.neighbours[i];
            if (r == other) continue;
            VertexSums& neighbour = mesh.sums[r];
            const Vec3 before = from - neighbour.position, after = place - neighbour.position;
            const bool shared =
                std::find(s.apex.begin(), s.apex.begin() + s.apexes, r) != s.apex.begin() + s.apexes;
            neighbour.link -= before;
            neighbour.link2 -= before.squaredNorm();
            if (shared && twice) {
                --mesh.state[r].degree;
                continue;
            }
            neighbour.link += after;
            neighbour.link2 += after.squaredNorm();
            sums.link -= after;
            sums.link2 += after.squaredNorm();
        }
    };
    relink(s.start, v1, from_v0, false);
    relink(s.end, v0, from_v1, true);
    mesh.unlink(h, s.end);
    mesh.sums[v0] = sums;
    mesh.state[v0].constraint = merged(mesh.state[v0].constraint, mesh.state[v1].constraint);
    mesh.state[v0].flags |= mesh.state[v1].flags;
    mesh.state[v0].degree = s.start.size + s.end.size - 2 - static_cast<std::uint32_t>(s.apexes);
}

}  // namespace sidewall::simplify
