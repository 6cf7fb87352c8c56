#include "app/devices/revolved.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "surface/turn.hpp"

namespace sidewall::app {

TriangleMesh revolved(const TriangleMesh& strip, int sides) {
    const double side = bounding_box(strip).min.y();
    const auto count = static_cast<std::uint32_t>(sides);
    TriangleMesh body;
    for (const Attribute& values : strip.triangle_attributes)
        body.triangle_attributes.emplace_back(values).values.clear();
    std::vector<std::uint32_t> first(strip.vertices.size(), ~0u);  // first copy of each vertex
    const auto copies = [&](std::uint32_t v) {
        if (first[v] != ~0u) return first[v];
        first[v] = static_cast<std::uint32_t>(body.vertices.size());
        const Vec3& p = strip.vertices[v];
        for (std::uint32_t k = 0; k < (p.x() > 0.0 ? count : 1); ++k) {
            const double angle = 2.0 * std::numbers::pi * k / count;
            body.vertices.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.z());
        }
        return first[v];
    };
    for (std::size_t t = 0; t < strip.triangles.size(); ++t)
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const std::uint32_t a = strip.triangles[t][corner], b = strip.triangles[t][(corner + 1) % 3];
            const Vec3 &p = strip.vertices[a], &q = strip.vertices[b];
            if (p.y() != side || q.y() != side) continue;
            const std::uint32_t from = copies(a), to = copies(b);
            const auto add = [&](const Triangle& triangle) {
                body.triangles.push_back(triangle);
                for (std::size_t n = 0; n < strip.triangle_attributes.size(); ++n) {
                    const Attribute& values = strip.triangle_attributes[n];
                    const auto size = static_cast<std::ptrdiff_t>(values.components),
                               begin = static_cast<std::ptrdiff_t>(t) * size;
                    std::copy_n(values.values.begin() + begin, size,
                                std::back_inserter(body.triangle_attributes[n].values));
                }
            };
            for (std::uint32_t k = 0; k < count; ++k) {
                const std::uint32_t next = (k + 1) % count;
                const std::uint32_t a0 = p.x() > 0.0 ? from + k : from, a1 = p.x() > 0.0 ? from + next : from,
                                    b0 = q.x() > 0.0 ? to + k : to, b1 = q.x() > 0.0 ? to + next : to;
                if (b0 != b1) add({a0, b0, b1});
                if (a0 != a1) add({a0, b1, a1});
            }
        }
    return body;
}

double revolved_area(const TriangleMesh& strip) {
    const Box3 box = bounding_box(strip);
    double area = 0.0;
    for (std::size_t t = 0; t < strip.triangles.size(); ++t)
        area += triangle_area(strip, t) * triangle_centroid(strip, t).x();
    return area / share_of_turn(box.max.y() - box.min.y(), 1.0);
}

}  // namespace sidewall::app
