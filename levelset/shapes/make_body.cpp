#include "levelset/shapes/make_body.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "levelset/shapes/mesh_body.hpp"
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

// The point relative to the shape's centre, or to its nearest repetition, at height \p z.
Vec3 local(const Vec3& p, const Shape& shape, double z, const Domain& domain) {
    return {wrapped(p.x() - shape.position[0], domain, 0), wrapped(p.y() - shape.position[1], domain, 1),
            p.z() - z};
}

// Signed distance from a box, or from a cylinder, by the \p excess over its half-lengths and radius.
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

// The space that a trench, hole or mask leaves open, from its bottom up and on above the wafer, so that
// nothing is left between opening and gas. Exact on the surface, elsewhere a bound of the distance.
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

// A fin or box without the wafer below, of half-spaces: exact on the surface, a bound off its edges.
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

// A tapered box: half its lengths along x and y at z = low and high.
struct Frustum {
    double low, high;
    std::array<double, 2> at_low, at_high;
};

double segment_distance(const Vec3& a, const Vec3& b, const Vec3& p) {
    const Vec3 ab = b - a;
    const double t = ab.squaredNorm() > 0.0 ? std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
    return (p - a - t * ab).norm();
}

// Exact signed distance. \p p has x, y >= 0, and so has the nearest point.
double distance_from(const Frustum& f, const Vec3& p) {
    const double slope = (f.at_low[0] - f.at_high[0]) / (f.high - f.low),
                 cosine = 1.0 / std::hypot(1.0, slope), sine = slope * cosine;
    double side[2];
    for (int a = 0; a < 2; ++a)
        side[a] = cosine * (p[a] - f.at_low[static_cast<std::size_t>(a)]) + sine * (p.z() - f.low);
    const double cap = std::max(p.z() - f.high, f.low - p.z()), inside = std::max({side[0], side[1], cap});
    if (inside <= 0.0) return inside;
    for (int a = 0; a < 2; ++a) {  // is the nearest point within a side face?
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

// All points within `radius` of a box smaller by that radius. The foot of a box on a wafer stays sharp.
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

// The profile as a polygon in x (or the distance from the axis) and z. An open one is closed far away. Where
// a closed one runs along the axis of revolution, it is led around beyond it: there is no surface there.
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
    double low = kInfinity, high = -low, left = low, right = high;
    for (const auto& p : shape.profile) {
        left = std::min(left, p[0]);
        right = std::max(right, p[0]);
        low = std::min(low, p[1]);
        high = std::max(high, p[1]);
        require(!shape.revolved || p[0] >= 0.0, "a profile of revolution has x at least 0");
    }
    const auto index = std::make_shared<const PolygonIndex>(
        std::vector<Polygon>{closed_profile(shape, open, far_away(domain))});
    const double sign = open && shape.subtract ? -1.0 : 1.0;  // the space above the curve is removed
    // On a periodic axis points are wrapped to half a period about the middle of the profile.
    const double middle = shape.revolved ? 0.0 : 0.5 * (left + right);
    return {[=, top = shape.top, revolved = shape.revolved](const Vec3& p) {
                const Vec3 q = local(p - middle * Vec3::UnitX(), shape, top, domain);
                return sign *
                       index->signed_distance(revolved ? std::hypot(q.x(), q.y()) : q.x() + middle, q.z());
            },
            shape.top + low, shape.top + high, !open};
}

// The body of a sphere, cylinder, gap, profile, box with rounded edges, or subtracted shape other than a
// plane or a mesh. Nothing for others.
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

using Vec2 = Eigen::Vector2d;

void require(bool good, const Shape& shape, const char* what) {
    if (!good) throw GeometryError("a layer's shape (top {}): {}", shape.top, what);
}

// Distance from the profile of a symmetric body, positive in the gas. \p s: distance from its axis (|x| of a
// trench or fin, radius of a hole).
double profile_distance(const std::vector<Vec2>& profile, double s, double z, bool gas) {
    double squared = kInfinity;
    const Vec2 p(s, z);
    for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
        const Vec2 &a = profile[k], ab = profile[k + 1] - a;
        const double t = std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
        squared = std::min(squared, (p - a - t * ab).squaredNorm());
    }
    return gas ? std::sqrt(squared) : -std::sqrt(squared);
}

// A recess of half-width `half` at the top whose walls lean inwards by `slope` (length per length).
Body recess(const Shape& shape, double half, bool round, const Domain& domain) {
    const double slope = std::tan(shape.taper_deg * std::numbers::pi / 180.0);
    const double far = far_away(domain);
    double depth = std::min(shape.depth, far);
    if (slope > 0.0) depth = std::min(depth, half / slope);  // the walls meet: a V
    const double bottom = shape.top - depth, half_bottom = std::max(0.0, half - slope * depth);
    const std::vector<Vec2> profile{
        {far, shape.top}, {half, shape.top}, {half_bottom, bottom}, {-far, bottom}};
    return {[=, top = shape.top, position = shape.position](const Vec3& p) {
                const double x = wrapped(p.x() - position[0], domain, 0);
                const double s = round ? std::hypot(x, wrapped(p.y() - position[1], domain, 1)) : std::abs(x);
                const double z = p.z();
                const bool gas = z > top || (z > bottom && s < half - slope * (top - z));
                return profile_distance(profile, s, z, gas);
            },
            std::isfinite(shape.depth) ? bottom : shape.top, shape.top};
}

Body fin(const Shape& shape, const Domain& domain) {
    const double half = 0.5 * shape.width, slope = std::tan(shape.taper_deg * std::numbers::pi / 180.0);
    const double height = slope > 0.0 ? std::min(shape.height, half / slope) : shape.height;
    const double far = far_away(domain), ridge = shape.top + height,
                 half_ridge = std::max(0.0, half - slope * height);
    const std::vector<Vec2> profile{{-far, ridge}, {half_ridge, ridge}, {half, shape.top}, {far, shape.top}};
    return {[=, top = shape.top, position = shape.position](const Vec3& p) {
                const double s = std::abs(wrapped(p.x() - position[0], domain, 0)), z = p.z();
                const bool gas = z > ridge || (z > top && s > half - slope * (z - top));
                return profile_distance(profile, s, z, gas);
            },
            shape.top, ridge};
}

// Half-spaces: exact on the surface and inside, a lower bound of the distance off its edges.
Body box(const Shape& shape, const Domain& domain) {
    const double angle = shape.taper_deg * std::numbers::pi / 180.0, top = shape.top + shape.height;
    return {[=, foot = shape.top, size = shape.size, position = shape.position](const Vec3& p) {
                double d = p.z() - top;
                for (int axis = 0; axis < 2; ++axis) {
                    const auto a = static_cast<std::size_t>(axis);
                    const double offset =
                        std::abs(wrapped(p[axis] - position[a], domain, axis)) - 0.5 * size[a];
                    d = std::max(d, std::cos(angle) * offset + std::sin(angle) * (p.z() - foot));
                }
                return std::min(d, p.z() - foot);
            },
            shape.top, top};
}

Body mask(const Shape& shape, const Domain& domain) {
    Outline open = outline(shape, domain);
    const double base = shape.base;
    require(base < shape.top, shape, "a mask's base must lie below its top");
    if (std::isinf(base))
        return {[open = std::move(open), top = shape.top](const Vec3& p) {
                    return std::max(p.z() - top, -open(p.x(), p.y()));
                },
                shape.top, shape.top};
    return {[open = std::move(open), top = shape.top, base](const Vec3& p) {
                return std::max({p.z() - top, base - p.z(), -open(p.x(), p.y())});
            },
            base, shape.top, true};
}

Body body_of(const Shape& shape, const Domain& domain) {
    require(std::abs(shape.taper_deg) < 90.0, shape, "taper_deg must lie between -90 and 90");
    if (std::optional<Body> solid = make_solid(shape, domain)) return *std::move(solid);
    switch (shape.kind) {
        case ShapeKind::plane:
            return {[top = shape.top](const Vec3& p) { return p.z() - top; }, shape.top, shape.top};
        case ShapeKind::trench:
            require(shape.width > 0.0 && shape.depth > 0.0, shape,
                    "a trench needs a positive width and depth");
            return recess(shape, 0.5 * shape.width, false, domain);
        case ShapeKind::hole:
            require(shape.radius > 0.0 && shape.depth > 0.0, shape,
                    "a hole needs a positive radius and depth");
            return recess(shape, shape.radius, true, domain);
        case ShapeKind::fin:
            require(shape.width > 0.0 && shape.height > 0.0, shape,
                    "a fin needs a positive width and height");
            return fin(shape, domain);
        case ShapeKind::box:
            require(shape.size[0] > 0.0 && shape.size[1] > 0.0 && shape.height > 0.0, shape,
                    "a box needs a positive size and height");
            return box(shape, domain);
        case ShapeKind::mesh:
            return mesh_body(shape, domain);
        case ShapeKind::mask:
            return mask(shape, domain);
        default:
            break;
    }
    throw GeometryError("unknown shape");
}

}  // namespace

Body make_body(const Shape& shape, const Domain& domain) {
    Body body = body_of(shape, domain);
    if (domain.axial)
        body.distance = [distance = std::move(body.distance)](const Vec3& p) {
            return distance({p.x(), 0.0, p.z()});
        };
    return body;
}

}  // namespace sidewall::levelset
