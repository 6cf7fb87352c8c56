#include "levelset/shapes/make_body.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "levelset/shapes/mesh_body.hpp"
#include "levelset/shapes/outline.hpp"
#include "levelset/shapes/solids.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

using Vec2 = Eigen::Vector2d;

void require(bool good, const Shape& shape, const char* what) {
    if (!good) throw GeometryError("a layer's shape (top {}): {}", shape.top, what);
}

// Distance from the axis (trench, fin: |x|; hole: radius) and height: the profile of a body that is symmetric
// about its axis.
double profile_distance(const std::vector<Vec2>& profile, double s, double z, bool gas) {
    double squared = std::numeric_limits<double>::infinity();
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
