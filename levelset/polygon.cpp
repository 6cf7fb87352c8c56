#include "levelset/polygon.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidewall::levelset {

double signed_distance(const std::vector<Polygon>& polygons, double x, double y) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Polygon& polygon : polygons) {
        double squared = std::numeric_limits<double>::infinity();
        bool inside = false;
        for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
            const auto [ax, ay] = polygon[j];
            const auto [bx, by] = polygon[k];
            const double ex = bx - ax, ey = by - ay, length = ex * ex + ey * ey;
            const double t =
                length > 0.0 ? std::clamp(((x - ax) * ex + (y - ay) * ey) / length, 0.0, 1.0) : 0.0;
            const double dx = x - ax - t * ex, dy = y - ay - t * ey;
            squared = std::min(squared, dx * dx + dy * dy);
            if ((ay > y) != (by > y) && x < ax + (y - ay) / ey * ex) inside = !inside;
        }
        nearest = std::min(nearest, inside ? -std::sqrt(squared) : std::sqrt(squared));
    }
    return nearest;
}

}  // namespace sidewall::levelset
