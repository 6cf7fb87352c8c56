#include "levelset/shapes/polygon.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidewall::levelset {

Polygon distinct(Polygon polygon) {
    polygon.erase(std::unique(polygon.begin(), polygon.end()), polygon.end());
    while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
    return polygon;
}

void move_by(Polygon& polygon, const std::array<double, 2>& way) {
    for (auto& corner : polygon)
        for (std::size_t a = 0; a < 2; ++a) corner[a] += way[a];
}

double squared_distance(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y) {
    const auto [ax, ay] = a;
    const auto [bx, by] = b;
    const double ex = bx - ax, ey = by - ay, length = ex * ex + ey * ey;
    const double t = length > 0.0 ? std::clamp(((x - ax) * ex + (y - ay) * ey) / length, 0.0, 1.0) : 0.0;
    const double dx = x - ax - t * ex, dy = y - ay - t * ey;
    return dx * dx + dy * dy;
}

bool crosses(const std::array<double, 2>& a, const std::array<double, 2>& b, double x, double y) {
    return (a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
}

double signed_distance(std::span<const Polygon> polygons, double x, double y) {
    double squared = std::numeric_limits<double>::infinity();
    bool inside = false;
    for (const Polygon& polygon : polygons)
        for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
            squared = std::min(squared, squared_distance(polygon[j], polygon[k], x, y));
            inside ^= crosses(polygon[j], polygon[k], x, y);
        }
    return inside ? -std::sqrt(squared) : std::sqrt(squared);
}

}  // namespace sidewall::levelset
