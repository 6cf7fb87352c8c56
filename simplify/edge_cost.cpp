#include "simplify/edge_cost.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace sidewall::simplify {
namespace {

/// Strength of the pull towards the neighbours' mean, relative to the quadric's trace: enough to fix
/// directions that only rounding and grid noise determine.
constexpr double kPull = 1e-5;
/// Bound on the distance of the place from the edge's midpoint, in root mean square distances of the
/// neighbours. A smaller bound cuts off sharp corners: the optimum there lies far out until the next
/// collapse, the midpoint inside of the corner.
constexpr double kReach = 10.0;
/// Weight of the shape cost in every edge, to break ties; edges are about 1 long in CollapseMesh.
constexpr double kTieBreak = 1e-11;
/// sin^2 of 5 degrees: a triangle is a needle if the angle opposite to the edge is less.
constexpr double kNeedle = 0.0871557 * 0.0871557;
/// Squared ratio of the edge to another one of its triangle, above which that is no needle: spares a test.
constexpr double kShort = 0.03;
/// Factor on the cost of the short edge of a needle. Factors from a tenth to a thousandth give the same mesh.
constexpr double kNeedleCost = 1.0 / 16.0;

/// The quadratic form x H x - 2 g x + c, with x relative to the edge's start: the sum of the squared volumes
/// swept (times 36). Further the volume constraint and the neighbours' mean and spread.
struct Form {
    Symmetric3 h;
    Vec3 g;
    double c;
    Vec3 normal;  ///< the plane normal . x = offset keeps the volume
    double offset;
    Vec3 along;  ///< edge vector, end - start
    double length2;
    Vec3 middle;          ///< mean position of the neighbours
    double count;         ///< number of neighbours
    double spread2;       ///< mean squared distance of the neighbours from the start
    bool needle = false;  ///< whether a triangle that vanishes is a needle
};

/// Adds the sums of both ends of an edge and counts the one or two triangles that they share once.
Form form_of(const CollapseMesh& mesh, std::uint32_t h) {
    const std::uint32_t a = mesh.start(h), b = mesh.end(h);
    const VertexSums &s = mesh.sums[a], &e = mesh.sums[b];
    Form f;
    f.along = e.position - s.position;
    f.length2 = f.along.squaredNorm();
    f.h = s.planes;
    f.h.add(e.planes);
    f.g = e.planes * f.along;
    f.c = f.along.dot(f.g);
    f.normal = s.normal + e.normal;
    f.offset = e.normal.dot(f.along);
    const double end_degree = mesh.state[b].degree;
    f.count = mesh.state[a].degree + end_degree - 2.0;
    f.middle = s.link - f.along + e.link + end_degree * f.along;
    f.spread2 = s.link2 - f.length2 + e.link2 + 2.0 * f.along.dot(e.link) + end_degree * f.length2;
    double sign = 1.0;
    for (const std::uint32_t side : {h, mesh.opposite[h]}) {
        if (side == kNoHalfedge) continue;
        const Vec3 apex = mesh.position(mesh.corner[CollapseMesh::previous(side)]) - s.position;
        const Vec3 normal = sign * f.along.cross(apex);
        const double height2 = apex.squaredNorm();
        if (f.length2 < kShort * height2)
            f.needle |= normal.squaredNorm() < kNeedle * height2 * (apex - f.along).squaredNorm();
        f.h.add_outer(normal, -1.0);
        f.normal -= normal;
        f.count -= 1.0;
        f.middle -= apex;
        f.spread2 -= height2;
        sign = -1.0;
    }
    f.count = std::max(f.count, 1.0);
    f.middle /= f.count;
    f.spread2 = std::max(0.0, f.spread2 / f.count);
    return f;
}

/// Minimum of the form on the plane that keeps the volume.
Vec3 place_inside(const Form& f) {
    const double trace = f.h.trace(), pull = kPull * trace;
    const double square = f.normal.squaredNorm();
    // Where area vectors cancel, as at a sharp fold, that plane is undefined: take the minimum in space.
    if (!(square > 1e-6 * trace)) {
        Eigen::Matrix3d m;
        m << f.h.xx + pull, f.h.xy, f.h.xz, f.h.xy, f.h.yy + pull, f.h.yz, f.h.xz, f.h.yz, f.h.zz + pull;
        return m.ldlt().solve(f.g + pull * f.middle);
    }
    const double inverse = 1.0 / std::sqrt(square);
    const Vec3 n = f.normal * inverse, base = n * (f.offset * inverse);
    // An orthonormal basis of the plane, as in surface/basis.hpp. Written out: a call would move the
    // compiler's fused multiply-adds, and with them the last bits of every mesh.
    const double sign = std::copysign(1.0, n.z()), p = -1.0 / (sign + n.z()), q = n.x() * n.y() * p;
    const Vec3 u(1.0 + sign * n.x() * n.x() * p, sign * q, -sign * n.x());
    const Vec3 v(q, sign + n.y() * n.y() * p, -n.y());
    const Vec3 hu = f.h * u, hv = f.h * v, rest = f.g - f.h * base + pull * f.middle;
    const double uu = u.dot(hu) + pull, uv = u.dot(hv), vv = v.dot(hv) + pull;
    const double ru = u.dot(rest), rv = v.dot(rest), determinant = uu * vv - uv * uv;
    return base + (u * (ru * vv - rv * uv) + v * (rv * uu - ru * uv)) / determinant;
}

/// Sum x h x - 2 g x + c of the squared areas swept by the boundary edges at both ends of an edge (times 4).
struct BoundaryForm {
    Symmetric3 h;
    Vec3 g = Vec3::Zero();
    double c = 0.0;
    Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();

    /// Adds |d x (x - p)|^2 for a boundary edge that starts at p, with edge vector d.
    void add(const Vec3& p, const Vec3& d) {
        h.add_cross(d, 1.0);
        const Vec3 m = d.cross(p);
        g -= d.cross(m);
        c += m.squaredNorm();
        sum += d;
        moment += m;
    }
};

BoundaryForm boundary_form(const CollapseMesh& mesh, std::uint32_t h) {
    const std::uint32_t a = mesh.start(h), b = mesh.end(h);
    const Vec3 origin = mesh.position(a);
    BoundaryForm form;
    const auto add = [&](std::uint32_t from, std::uint32_t to) {
        const Vec3 p = mesh.position(from) - origin, q = mesh.position(to) - origin;
        form.add(p, q - p);
    };
    for (const std::uint32_t v : {a, b}) {
        if (!mesh.flagged(v, kBoundary)) continue;
        const std::uint32_t first = mesh.leaving[v];
        std::uint32_t out = first, last = 0;
        do {
            last = CollapseMesh::previous(out);
            out = mesh.opposite[last];
        } while (out != kNoHalfedge);
        add(v, mesh.end(first));
        // Skip the collapsing edge itself: the other end adds it as its first one.
        if (const std::uint32_t before = mesh.start(last); before != a && before != b) add(before, v);
    }
    return form;
}

/// Minimum of volume and boundary forms; a stiff penalty keeps it on the line of equal boundary area.
Vec3 place_on_boundary(const Form& f, const BoundaryForm& b, const Weights& w) {
    constexpr double kStiff = 1e4;
    const double boundary = 9.0 * std::max(w.boundary, 1e-3) * f.length2;
    Symmetric3 h;
    h.add(f.h, w.volume);
    h.add(b.h, boundary);
    Vec3 g = w.volume * f.g + boundary * b.g;
    const double stiff = kStiff * boundary;
    h.add_cross(b.sum, stiff);
    g -= stiff * b.sum.cross(b.moment);
    const double pull = kPull * (w.volume * f.h.trace() + boundary * b.h.trace());
    g += pull * 0.5 * f.along;
    Eigen::Matrix3d m;
    m << h.xx + pull, h.xy, h.xz, h.xy, h.yy + pull, h.yz, h.xz, h.yz, h.zz + pull;
    return m.ldlt().solve(g);
}

}  // namespace

Candidate edge_cost(const CollapseMesh& mesh, std::uint32_t h, const Weights& weights) {
    const std::uint32_t a = mesh.start(h), b = mesh.end(h);
    const MergedPlace place = mesh.merged_place(h);
    const Form f = form_of(mesh, h);
    const Vec3 origin = mesh.position(a);
    BoundaryForm boundary;
    Vec3 x;
    if (place == MergedPlace::free) {
        x = place_inside(f);
    } else {
        boundary = boundary_form(mesh, h);
        const VertexKind kind_a = mesh.state[a].constraint.kind, kind_b = mesh.state[b].constraint.kind;
        // Cases: one end off the boundary; two kinds; two corner vertices; along the boundary. Fewer branches
        // would move the compiler's fused multiply-adds, and with them the last bits of every mesh.
        // NOLINTBEGIN(bugprone-branch-clone)
        if ((kind_a == VertexKind::interior) != (kind_b == VertexKind::interior))
            x = place == MergedPlace::start ? Vec3(Vec3::Zero()) : f.along;
        else if (kind_a != kind_b)
            x = place == MergedPlace::start ? Vec3(Vec3::Zero()) : f.along;
        else if (place == MergedPlace::start)
            x = Vec3::Zero();
        else
            x = place_on_boundary(f, boundary, weights);
        // NOLINTEND(bugprone-branch-clone)
    }
    // A place out of reach (kReach), or not a number, becomes the midpoint.
    const Vec3 half = 0.5 * f.along;
    const double reach2 = f.spread2 - 2.0 * half.dot(f.middle) + half.squaredNorm();
    if (f.length2 == 0.0)
        x = Vec3::Zero();
    else if (!((x - half).squaredNorm() <= kReach * kReach * std::max(reach2, f.length2)))
        x = half;

    Candidate result;
    result.place = x + origin;
    // An end that is kept stays bit for bit; any other place is clamped to the box and the side planes.
    if (x.isZero(0.0)) {
        result.place = origin;
    } else if (x == f.along) {
        result.place = mesh.position(b);
    } else {
        const int planes = mesh.state[a].constraint.planes & mesh.state[b].constraint.planes;
        result.place = result.place.cwiseMax(mesh.low).cwiseMin(mesh.high);
        move_into(planes, result.place, mesh.low, mesh.high);
        x = result.place - origin;
    }
    const double swept = x.dot(f.h * x) - 2.0 * f.g.dot(x) + f.c;
    const double shape = f.count * (x.squaredNorm() - 2.0 * x.dot(f.middle) + f.spread2);
    const double area = x.dot(boundary.h * x) - 2.0 * boundary.g.dot(x) + boundary.c;
    result.cost = weights.volume / 36.0 * std::max(0.0, swept) +
                  weights.boundary / 4.0 * f.length2 * std::max(0.0, area) +
                  (weights.shape + kTieBreak) * f.length2 * f.length2 * std::max(0.0, shape);
    if (f.needle) result.cost *= kNeedleCost;
    result.swept = std::max(0.0, swept);
    result.area2 = f.h.trace();
    return result;
}

}  // namespace sidewall::simplify
