#include "levelset/shapes/solids.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "levelset/shapes/outline.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

void require(bool good, const char* what) {
    if (!good) throw GeometryError("a layer's shape: {}", what);
}

double radians(const Shape& shape) {
    return shape.taper_deg * std::numbers::pi / 180.0;
}

// Offsets from the shape's centre, the nearest repetition's.
Vec3 local(const Vec3& p, const Shape& shape, double z, const Domain& domain) {
    return {wrapped(p.x() - shape.position[0], domain, 0), wrapped(p.y() - shape.position[1], domain, 1),
            p.z() - z};
}

// Distance from a box around 0, or from a cylinder as the box of its radius and its half-length.
double box_distance(const Vec3& excess) {
    return excess.cwiseMax(0.0).norm() + std::min(excess.maxCoeff(), 0.0);
}

Body sphere(const Shape& shape, const Domain& domain) {
    require(shape.radius > 0.0, "a sphere needs a positive radius");
    return {
        [=, z = shape.centre_z](const Vec3& p) { return local(p, shape, z, domain).norm() - shape.radius; },
        shape.centre_z - shape.radius, shape.centre_z + shape.radius, true};
}

Body cylinder(const Shape& shape, const Domain& domain) {
    require(shape.radius > 0.0 && shape.length > 0.0, "a cylinder needs a positive radius and length");
    const int along = shape.axis, u = (along + 1) % 3, v = (along + 2) % 3;
    require(along != 2 || std::isfinite(shape.length), "a vertical cylinder needs a length");
    const double half = along == 2 ? 0.5 * shape.length : shape.radius;
    return {[=, z = shape.centre_z](const Vec3& p) {
                const Vec3 q = local(p, shape, z, domain);
                return box_distance(
                    {std::hypot(q[u], q[v]) - shape.radius, std::abs(q[along]) - 0.5 * shape.length, -kFar});
            },
            shape.centre_z - half, shape.centre_z + half, true};
}

// A lateral cavity; without a length or a width it goes through the whole domain along x or y.
Body gap(const Shape& shape, const Domain& domain) {
    require(shape.height > 0.0 && shape.length > 0.0 && shape.width > 0.0,
            "a gap needs a positive height, length and width");
    return {[=, z = shape.centre_z](const Vec3& p) {
                const Vec3 q = local(p, shape, z, domain).cwiseAbs();
                return box_distance(q - 0.5 * Vec3(shape.length, shape.width, shape.height));
            },
            shape.centre_z - 0.5 * shape.height, shape.centre_z + 0.5 * shape.height, true};
}

// What a trench, hole or mask leaves open from its bottom up, above the wafer too: there is nothing between
// the opening and the gas. Exact on the surface, else a bound.
Body opening(const Shape& shape, const Domain& domain) {
    require(shape.depth > 0.0 && std::isfinite(shape.depth),
            "what is cut out from above needs a positive depth");
    const double top = shape.top, bottom = top - shape.depth, lean = std::cos(radians(shape)),
                 slope = shape.kind == ShapeKind::mask ? 0.0 : std::tan(radians(shape));
    return {[=, within = outline(shape, domain)](const Vec3& p) {
                const double wall = lean * (within(p.x(), p.y()) + slope * std::max(0.0, top - p.z()));
                return std::max(slope == 0.0 ? within(p.x(), p.y()) : wall, bottom - p.z());
            },
            bottom, top};
}

// A fin or box without the wafer it stands on: half-spaces, exact on the surface and a bound off its edges.
Body block(const Shape& shape, const Domain& domain) {
    const bool fin = shape.kind == ShapeKind::fin;
    const double sine = std::sin(radians(shape)), cosine = std::cos(radians(shape)), foot = shape.top,
                 top = foot + shape.height, half_x = 0.5 * (fin ? shape.width : shape.size[0]),
                 half_y = fin ? kFar : 0.5 * shape.size[1];
    require(half_x > 0.0 && half_y > 0.0 && shape.height > 0.0,
            "a fin or box needs a positive size and height");
    return {[=](const Vec3& p) {
                const Vec3 q = local(p, shape, foot, domain).cwiseAbs();
                double d = std::max(p.z() - top, foot - p.z());
                d = std::max(d, cosine * (q.x() - half_x) + sine * (p.z() - foot));
                return fin ? d : std::max(d, cosine * (q.y() - half_y) + sine * (p.z() - foot));
            },
            foot, top, true};
}

// Half of a box's lengths along x and y at z = low and high.
struct Frustum {
    double low, high;
    std::array<double, 2> at_low, at_high;
};

double segment_distance(const Vec3& a, const Vec3& b, const Vec3& p) {
    const Vec3 ab = b - a;
    const double t = ab.squaredNorm() > 0.0 ? std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
    return (p - a - t * ab).norm();
}

// Exact; \p p in the quarter of positive x and y, where the nearest point lies, too.
double distance_from(const Frustum& f, const Vec3& p) {
    const double slope = (f.at_low[0] - f.at_high[0]) / (f.high - f.low),
                 cosine = 1.0 / std::hypot(1.0, slope), sine = slope * cosine;
    double side[2];
    for (int a = 0; a < 2; ++a)
        side[a] = cosine * (p[a] - f.at_low[static_cast<std::size_t>(a)]) + sine * (p.z() - f.low);
    const double cap = std::max(p.z() - f.high, f.low - p.z()), inside = std::max({side[0], side[1], cap});
    if (inside <= 0.0) return inside;
    for (int a = 0; a < 2; ++a) {  // above the middle of a side?
        const auto other = static_cast<std::size_t>(1 - a);
        const double z = p.z() - side[a] * sine;
        if (side[a] > 0.0 && z >= f.low && z <= f.high && p[1 - a] <= f.at_low[other] - slope * (z - f.low))
            return side[a];
    }
    const auto& end = p.z() > f.high ? f.at_high : f.at_low;
    if (cap > 0.0 && p.x() <= end[0] && p.y() <= end[1]) return cap;
    const Vec3 low(f.at_low[0], f.at_low[1], f.low), high(f.at_high[0], f.at_high[1], f.high);
    double d = segment_distance(low, high, p);
    for (const Vec3& corner : {low, high})
        for (const Vec3& other : {Vec3(0.0, corner.y(), corner.z()), Vec3(corner.x(), 0.0, corner.z())})
            d = std::min(d, segment_distance(other, corner, p));
    return d;
}

// All points within `radius` of a box that is smaller by as much. On a wafer the foot stays sharp.
Body rounded_box(const Shape& shape, const Domain& domain) {
    const double angle = radians(shape), slope = std::tan(angle), r = shape.radius, foot = shape.top,
                 top = foot + shape.height;
    const double low = shape.subtract ? foot + r : foot - r * std::abs(std::sin(angle)), high = top - r;
    Frustum core{low, high, {}, {}};
    for (std::size_t a = 0; a < 2; ++a) {
        core.at_low[a] = 0.5 * shape.size[a] - slope * (low - foot) - r / std::cos(angle);
        core.at_high[a] = 0.5 * shape.size[a] - slope * (high - foot) - r / std::cos(angle);
        require(core.at_low[a] >= 0.0 && core.at_high[a] >= 0.0, "a box's edges are rounder than it is wide");
    }
    require(high > low, "a box's edges are rounder than it is high");
    return {[=, stands = !shape.subtract](const Vec3& p) {
                const Vec3 q = local(p, shape, 0.0, domain);
                const double d = distance_from(core, {std::abs(q.x()), std::abs(q.y()), q.z()}) - r;
                return stands ? std::min(d, p.z() - foot) : d;
            },
            foot, top, shape.subtract};
}

// The outline in the plane of x, or the distance from the axis, and z: an open one closed far away, and where
// it runs along the axis of revolution led around beyond it, since nothing ends there.
Polygon closed_profile(const Shape& shape, bool open, double far) {
    Polygon points = shape.profile;
    if (open) {
        if (points.front()[0] > points.back()[0]) std::reverse(points.begin(), points.end());
        points.insert(points.begin(), {{-far, -far}, {-far, points.front()[1]}});
        points.insert(points.end(), {{far, points.back()[1]}, {far, -far}});
        return points;
    }
    points.pop_back();
    if (!shape.revolved) return points;
    Polygon result;
    for (std::size_t k = 0; k < points.size(); ++k) {
        const auto &a = points[k], &b = points[(k + 1) % points.size()];
        result.push_back(a);
        if (a[0] == 0.0 && b[0] == 0.0) result.insert(result.end(), {{-far, a[1]}, {-far, b[1]}});
    }
    return result;
}

Body profile(const Shape& shape, const Domain& domain) {
    require(shape.profile.size() > 1, "a profile needs two points");
    const bool open = shape.profile.front() != shape.profile.back();
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& p : shape.profile) {
        low = std::min(low, p[1]);
        high = std::max(high, p[1]);
        require(!shape.revolved || p[0] >= 0.0, "a profile of revolution has x at least 0");
    }
    const auto index = std::make_shared<const PolygonIndex>(
        std::vector<Polygon>{closed_profile(shape, open, far_away(domain))});
    const double sign = open && shape.subtract ? -1.0 : 1.0;  // above the curve is what goes
    return {[=, top = shape.top, revolved = shape.revolved](const Vec3& p) {
                const Vec3 q = local(p, shape, top, domain);
                return sign * index->signed_distance(revolved ? std::hypot(q.x(), q.y()) : q.x(), q.z());
            },
            shape.top + low, shape.top + high, !open};
}

}  // namespace

std::optional<Body> make_solid(const Shape& shape, const Domain& domain) {
    switch (shape.kind) {
        case ShapeKind::sphere:
            return sphere(shape, domain);
        case ShapeKind::cylinder:
            return cylinder(shape, domain);
        case ShapeKind::gap:
            return gap(shape, domain);
        case ShapeKind::profile:
            return profile(shape, domain);
        case ShapeKind::box:
            if (shape.radius > 0.0) return rounded_box(shape, domain);
            [[fallthrough]];
        case ShapeKind::fin:
            if (shape.subtract) return block(shape, domain);
            break;
        case ShapeKind::trench:
        case ShapeKind::hole:
        case ShapeKind::mask:
            if (shape.subtract) return opening(shape, domain);
            break;
        case ShapeKind::plane:
        case ShapeKind::mesh:
            break;
    }
    return std::nullopt;
}

}  // namespace sidewall::levelset
