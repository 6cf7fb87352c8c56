#include "levelset/shapes/outline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "levelset/shapes/polygon_clipping.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

Outline polygons(const Shape& shape, const Domain& domain) {
    std::vector<Polygon> polygons = shape.polygons;
    for (Polygon& polygon : polygons) move_by(polygon, shape.position);
    if (!shape.contours) polygons = united(repeated(polygons, domain));
    const auto index = std::make_shared<const PolygonIndex>(polygons);
    return [index](double x, double y) { return index->signed_distance(x, y); };
}

Outline figure(const Shape& shape, const Domain& domain) {
    const double x0 = shape.position[0], y0 = shape.position[1];
    switch (shape.kind) {
        case ShapeKind::mask:
            return polygons(shape, domain);
        case ShapeKind::trench:
            return [=, half = 0.5 * shape.width](double x, double) {
                return std::abs(wrapped(x - x0, domain, 0)) - half;
            };
        case ShapeKind::hole:
            return [=, radius = shape.radius](double x, double y) {
                return std::hypot(wrapped(x - x0, domain, 0), wrapped(y - y0, domain, 1)) - radius;
            };
        case ShapeKind::box:
            return [=, size = shape.size](double x, double y) {
                const double u = std::abs(wrapped(x - x0, domain, 0)) - 0.5 * size[0],
                             v = std::abs(wrapped(y - y0, domain, 1)) - 0.5 * size[1];
                return std::hypot(std::max(u, 0.0), std::max(v, 0.0)) + std::min(std::max(u, v), 0.0);
            };
        default:
            throw GeometryError("only polygons, a trench, a hole or a box are an outline");
    }
}

}  // namespace

std::vector<Polygon> repeated(const std::vector<Polygon>& polygons, const Domain& domain) {
    std::vector<Polygon> result = polygons;
    for (std::size_t a = 0; a < 2; ++a) {
        const double length = domain.max[a] - domain.min[a];
        std::vector<Polygon> kept;
        for (const Polygon& polygon : result) {
            double low = kInfinity, high = -low;
            for (const auto& p : polygon) {
                low = std::min(low, p[a]);
                high = std::max(high, p[a]);
            }
            // Polygons within half an extent around the box keep distances within it true.
            const double from = domain.min[a] - 0.5 * length, to = domain.max[a] + 0.5 * length;
            const bool periodic = domain.side[a] == Side::periodic;
            const double first = periodic ? std::ceil((from - high) / length) : 0.0,
                         last = periodic ? std::floor((to - low) / length) : 0.0;
            constexpr double kMostCopies = 1000.0;
            if (last - first > kMostCopies)
                throw GeometryError(
                    "a mask's polygon is over 1000 times as wide as the periodic domain: check its unit");
            for (double n = first; n <= last; n += 1.0) {
                if (high + n * length < from || low + n * length > to) continue;
                kept.push_back(polygon);
                for (auto& p : kept.back()) p[a] += n * length;
            }
        }
        result = std::move(kept);
    }
    return result;
}

double wrapped(double offset, const Domain& domain, int axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (domain.side[a] != Side::periodic) return offset;
    const double length = domain.max[a] - domain.min[a];
    return offset - length * std::round(offset / length);
}

Outline outline(const Shape& shape, const Domain& domain) {
    Outline inside = figure(shape, domain);
    if (domain.axial)  // nodes lie beside the plane of r and z
        inside = [inside = std::move(inside)](double x, double) { return inside(x, 0.0); };
    if (shape.openings) return inside;
    return [inside = std::move(inside)](double x, double y) { return -inside(x, y); };
}

}  // namespace sidewall::levelset
