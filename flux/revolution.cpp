#include "flux/revolution.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "surface/error.hpp"
#include "surface/infinity.hpp"

namespace sidewall::flux {

TriangleMesh sector_of(const TriangleMesh& strip, double radius, double width) {
    constexpr double kAtAxis = 1e-6;
    if (strip.vertices.size() % 2 != 0) throw GeometryError("a round profile's vertices must be twins");
    TriangleMesh sector = strip;
    for (std::size_t v = 0; v < strip.vertices.size(); v += 2) {
        Vec3 &low = sector.vertices[v], &high = sector.vertices[v + 1];
        if (low.x() != high.x() || low.z() != high.z() || low.x() < 0.0)
            throw GeometryError(
                "a round profile's vertices {} and {} must lie at the same r and z, r at least 0", v, v + 1);
        high.y() = 0.5 * width * std::max(low.x() / radius, kAtAxis);
        low.y() = -high.y();
    }
    return sector;
}

void join_rings(const TriangleMesh& sector, Wedges& wedges) {
    for (std::uint32_t v = 0; v + 1 < sector.vertices.size(); v += 2) {
        const std::uint32_t low = wedges.first[v], high = wedges.first[v + 1], end = wedges.first[v + 2];
        if (high - low != end - high)
            throw GeometryError("a round profile's vertices {} and {} differ", v, v + 1);
        for (std::uint32_t w = high; w < end; ++w) {
            wedges.area[w - high + low] += wedges.area[w];
            wedges.area[w] = 0.0;
        }
    }
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        if (const std::uint32_t v = sector.triangles[c / 3][c % 3]; v % 2 != 0)
            wedges.corner[c] -= wedges.first[v] - wedges.first[v - 1];
}

void share_rings(FluxField& by_vertex) {
    for (std::size_t v = 0; v + 1 < by_vertex.flux.size(); v += 2) {
        by_vertex.flux[v + 1] = by_vertex.flux[v];
        by_vertex.error[v + 1] = by_vertex.error[v];
    }
}

void smooth_about_axis(const TriangleMesh& sector, const Wedges& wedges, const FluxField& by_wedge,
                       std::vector<double>& smooth, double resolution) {
    constexpr std::size_t kMostRings = 18, kFewestRings = 4;
    constexpr auto kNone = static_cast<std::size_t>(-1);
    // The first two corners of a segment's first triangle lie on its first and its second ring.
    const auto ring = [&](std::size_t segment, std::size_t end) { return wedges.corner[6 * segment + end]; };
    const auto radius = [&](std::size_t segment, std::size_t end) {
        return sector.vertices[sector.triangles[2 * segment][end]].x();
    };
    // Whether a segment, followed from the given end, leads outwards within 45 degrees of the horizontal.
    const auto goes_outwards = [&](std::size_t segment, std::size_t end) {
        const auto& triangle = sector.triangles[2 * segment];
        const Vec3 way = sector.vertices[triangle[1 - end]] - sector.vertices[triangle[end]];
        return way.x() > 0.7 * way.norm();
    };
    std::vector<std::array<std::size_t, 2>> segments(wedges.count(), {kNone, kNone});  // of each ring
    for (std::size_t k = 0; 2 * k < sector.triangles.size(); ++k)
        for (std::size_t end = 0; end < 2; ++end) {
            auto& of_ring = segments[ring(k, end)];
            of_ring[of_ring[0] == kNone ? 0 : 1] = k;
        }
    struct Ring {
        std::uint32_t wedge;
        double r;
    };
    for (std::size_t first = 0; 2 * first < sector.triangles.size(); ++first)
        for (std::size_t end = 0; end < 2; ++end) {
            if (radius(first, end) != 0.0) continue;
            std::vector<Ring> rings{{ring(first, end), 0.0}};
            for (std::size_t k = first, from = end; k != kNone && rings.size() < kMostRings;) {
                const std::uint32_t next = ring(k, 1 - from);
                if (!goes_outwards(k, from)) break;
                rings.push_back({next, radius(k, 1 - from)});
                k = segments[next][segments[next][0] == k ? 1 : 0];
                if (k != kNone) from = ring(k, 0) == next ? 0 : 1;
            }
            rings.resize(2 * rings.size() / 3);
            if (rings.size() < kFewestRings) continue;
            double sum = 0.0, sum_s = 0.0, sum_ss = 0.0, sum_f = 0.0, sum_sf = 0.0, variance = 0.0;
            for (const auto& [w, r] : rings) {
                const double area = wedges.area[w], s = r * r, f = by_wedge.flux[w];
                sum += area, sum_s += area * s, sum_ss += area * s * s, sum_f += area * f,
                    sum_sf += area * s * f, variance += area * by_wedge.error[w] * by_wedge.error[w];
            }
            const double mean = sum_f / sum, spread = sum * sum_ss - sum_s * sum_s;
            variance /= sum;
            const double tau = resolution * mean, all = variance + tau * tau;
            if (!(spread > 0.0) || !(all > 0.0)) continue;
            const double slope = (sum * sum_sf - sum_s * sum_f) / spread;
            for (const auto& [w, r] : rings) {
                const double fit = mean + slope * (r * r - sum_s / sum);
                smooth[w] = by_wedge.flux[w] + variance / all * (std::max(0.0, fit) - by_wedge.flux[w]);
            }
        }
}

void share_segments(const TriangleMesh& sector, FluxField& by_triangle) {
    for (std::size_t t = 0; t + 1 < sector.triangles.size(); t += 2) {
        const double one = triangle_area(sector, t), other = triangle_area(sector, t + 1), sum = one + other;
        if (!(sum > 0.0)) continue;
        std::vector<double>&flux = by_triangle.flux, &error = by_triangle.error;
        flux[t] = flux[t + 1] = (one * flux[t] + other * flux[t + 1]) / sum;
        error[t] = error[t + 1] = std::hypot(one * error[t], other * error[t + 1]) / sum;
    }
}

Revolution::Revolution(const TriangleMesh& sector) {
    // Segments are extended by this at both ends: rounding leaves no gap between neighbours.
    constexpr double kSlack = 1e-10;  // of the largest coordinate
    const double slack = kSlack * [&] {
        double most = 0.0;
        for (const Vec3& p : sector.vertices) most = std::max({most, p.x(), std::abs(p.z())});
        return most;
    }();
    std::vector<std::uint32_t> order;
    for (std::size_t t = 0; t + 1 < sector.triangles.size(); t += 2) {
        const auto [a, b, c] = sector.triangles[t];
        if (a % 2 != 0 || b % 2 != 0 || c != b + 1 || sector.triangles[t + 1] != Triangle{a, c, a + 1})
            throw GeometryError("triangles {} and {} are no segment of a round profile", t, t + 1);
        const Vec3 &from = sector.vertices[a], &to = sector.vertices[b];
        const double dr = to.x() - from.x(), dz = to.z() - from.z(), length = std::hypot(dr, dz);
        Segment s{from.x(), from.z(), dr, dz, 0.0, 0.0, 0.0, 0.0, 0.0};
        if (length > 0.0) {
            // The normal is (-dz, dr) or its opposite, on the same side as the triangles' normal.
            const double side = area_vector(sector, t).dot(Vec3(-dz, 0.0, dr)) > 0.0 ? 1.0 : -1.0;
            s.nr = -side * dz / length, s.nz = side * dr / length;
            s.plane = s.nr * s.r + s.nz * s.z;
            s.inverse_square = 1.0 / (length * length);
            s.slack = slack / length;
            order.push_back(static_cast<std::uint32_t>(segments_.size()));
        }
        segments_.push_back(s);
    }
    if (order.empty()) throw GeometryError("a round profile has no segment: nothing can be traced");
    Node box{};
    root_ = build(order.begin(), order.end(), box);
    if (root_ < 0) {  // a single segment
        nodes_.push_back(box);
        root_ = 0;
    }
}

// Builds the node over some segments and puts its box into place 0 of \p box. A single segment needs no node.
std::int32_t Revolution::build(std::vector<std::uint32_t>::iterator first,
                               std::vector<std::uint32_t>::iterator last, Node& box) {
    double inner = kInfinity, outer = 0.0, low = kInfinity, high = -kInfinity;
    for (auto i = first; i != last; ++i) {
        const Segment& s = segments_[*i];
        const double margin = s.slack / std::sqrt(s.inverse_square);
        inner = std::min(inner, std::max(0.0, std::min(s.r, s.r + s.dr) - margin));
        outer = std::max(outer, std::max(s.r, s.r + s.dr) + margin);
        low = std::min(low, std::min(s.z, s.z + s.dz) - margin);
        high = std::max(high, std::max(s.z, s.z + s.dz) + margin);
    }
    box.inner.fill(kInfinity), box.outer.fill(-1.0), box.low.fill(kInfinity), box.high.fill(-kInfinity);
    box.child.fill(0);
    box.inner[0] = inner * inner, box.outer[0] = outer * outer, box.low[0] = low, box.high[0] = high;
    if (last - first == 1) return box.child[0] = ~static_cast<std::int32_t>(*first);
    // Eight parts: halve three times, each part at the median along the longer side of its box.
    std::array<std::vector<std::uint32_t>::iterator, kChildren + 1> end;
    end.front() = first, end.back() = last;
    for (std::size_t step = kChildren; step > 1; step /= 2)
        for (std::size_t k = 0; k < kChildren; k += step) {
            const auto begin = end[k], stop = end[k + step], middle = begin + (stop - begin) / 2;
            double wide[2] = {kInfinity, -kInfinity}, tall[2] = {kInfinity, -kInfinity};
            for (auto i = begin; i != stop; ++i) {
                const double r = segments_[*i].r, z = segments_[*i].z;
                wide[0] = std::min(wide[0], r), wide[1] = std::max(wide[1], r);
                tall[0] = std::min(tall[0], z), tall[1] = std::max(tall[1], z);
            }
            const bool by_r = wide[1] - wide[0] > tall[1] - tall[0];
            std::nth_element(begin, middle, stop, [&](std::uint32_t a, std::uint32_t b) {
                const Segment &s = segments_[a], &t = segments_[b];
                const double at = by_r ? 2.0 * s.r + s.dr : 2.0 * s.z + s.dz,
                             other = by_r ? 2.0 * t.r + t.dr : 2.0 * t.z + t.dz;
                return at < other || (at == other && a < b);
            });
            end[k + step / 2] = middle;
        }
    const auto place = static_cast<std::int32_t>(nodes_.size());
    nodes_.emplace_back();
    Node node = box;
    node.outer[0] = -1.0, node.inner[0] = kInfinity, node.low[0] = kInfinity, node.high[0] = -kInfinity;
    for (std::size_t k = 0; k < kChildren; ++k) {
        if (end[k] == end[k + 1]) continue;
        Node part{};
        node.child[k] = build(end[k], end[k + 1], part);
        node.inner[k] = part.inner[0], node.outer[k] = part.outer[0];
        node.low[k] = part.low[0], node.high[k] = part.high[0];
    }
    nodes_[static_cast<std::size_t>(place)] = node;
    return box.child[0] = place;
}

// A path with r^2 = a t^2 + 2 b t + c. It is nearest to the axis at t = `closest`, where r^2 is
// nearest_square = turn^2 / a; turn = x dy - y dx.
struct Revolution::Ray {
    Vec3 origin, direction;
    double a, b, c, turn, closest, nearest_square;
};

// Intersects a path with the cone nr r = plane - nz z. With p + q t for the right side, both sides squared
// give (nr^2 a - q^2) t^2 + 2 (nr^2 b - p q) t + (nr^2 c - p^2) = 0. The discriminant over nr^2 is written as
// |p d - q o|^2 - (nr turn)^2 (d, o: direction and origin in x and y), which avoids cancellation.
void Revolution::meet(const Ray& ray, std::uint32_t segment, RingHit& best) const {
    constexpr double kFlat = 1e-20;  // nr^2 below this is rounding: the segment is horizontal
    const Segment& s = segments_[segment];
    const double p = s.plane - s.nz * ray.origin.z(), q = -s.nz * ray.direction.z(), square = s.nr * s.nr;
    const double x = p * ray.direction.x() - q * ray.origin.x(),
                 y = p * ray.direction.y() - q * ray.origin.y();
    const double root = x * x + y * y - square * ray.turn * ray.turn;
    if (!(root >= 0.0)) return;
    const double half = square * ray.b - p * q, shift = std::abs(s.nr) * std::sqrt(root);
    const double far = -(half + (half < 0.0 ? -shift : shift));
    const double times[2] = {far / (square * ray.a - q * q), (square * ray.c - p * p) / far};
    for (const double t : times) {
        if (!(t > 0.0 && t < best.distance)) continue;  // skips NaN, too
        const double r = std::sqrt(std::max(0.0, (ray.a * t + 2.0 * ray.b) * t + ray.c));
        const double z = ray.origin.z() + t * ray.direction.z();
        // Squaring added the cone's other nappe, which is not part of the surface; a flat cone has none.
        if (square > kFlat && s.nr * (p + q * t) < 0.0) continue;
        const double along = ((r - s.r) * s.dr + (z - s.z) * s.dz) * s.inverse_square;
        if (!(along >= -s.slack && along <= 1.0 + s.slack)) continue;
        const double outwards = r > 0.0 ? (ray.a * t + ray.b) / r : 0.0;
        if (!(s.nr * outwards + s.nz * ray.direction.z() < 0.0)) continue;
        best = {segment, t, std::clamp(along, 0.0, 1.0)};
    }
}

RingHit Revolution::closest_front(const Vec3& origin, const Vec3& direction, double reach) const {
    Ray ray{origin,
            direction,
            direction.head<2>().squaredNorm(),
            origin.head<2>().dot(direction.head<2>()),
            origin.head<2>().squaredNorm(),
            origin.x() * direction.y() - origin.y() * direction.x(),
            0.0,
            0.0};
    const bool upright = !(ray.a > 0.0);
    ray.closest = upright ? 0.0 : -ray.b / ray.a;
    ray.nearest_square = upright ? ray.c : ray.turn * ray.turn / ray.a;
    constexpr double kLevel = 1e-300;  // replaces a rise of 0: a level path is inside a z slab or outside
    const double rise = std::abs(direction.z()) > kLevel ? direction.z() : kLevel, inverse = 1.0 / rise;
    RingHit best{RingHit::kNone, reach, 0.0};
    struct Entry {
        std::int32_t node;
        double from;
    };
    std::array<Entry, 128> stack;  // at most seven more for each level of the tree
    std::size_t size = 0;
    stack[size++] = {root_, 0.0};
    const double z = origin.z(), slack = 1e-12 * ray.c;
    while (size > 0) {
        const Entry entry = stack[--size];
        if (entry.from > best.distance) continue;
        const Node& node = nodes_[static_cast<std::size_t>(entry.node)];
        std::array<double, kChildren> from;
        std::array<int, kChildren> meets;
        for (std::size_t k = 0; k < kChildren; ++k) {
            const double one = (node.low[k] - z) * inverse, other = (node.high[k] - z) * inverse;
            const double t0 = std::max(0.0, std::min(one, other)),
                         t1 = std::min(best.distance, std::max(one, other));
            const double before = t0 - ray.closest, after = t1 - ray.closest;
            const double off = before > 0.0 ? before : after < 0.0 ? after : 0.0;
            const double near = ray.nearest_square + ray.a * off * off,
                         far = ray.nearest_square + ray.a * std::max(before * before, after * after);
            from[k] = t0;
            const int slab = t0 <= t1 ? 1 : 0, inside = near <= node.outer[k] + slack ? 1 : 0,
                      outside = far + slack >= node.inner[k] ? 1 : 0;
            meets[k] = slab & inside & outside;
        }
        const std::size_t base = size;
        for (std::size_t k = 0; k < kChildren; ++k) {
            if (meets[k] == 0) continue;
            if (node.child[k] < 0) {
                meet(ray, static_cast<std::uint32_t>(~node.child[k]), best);
                continue;
            }
            std::size_t i = size++;
            for (; i > base && stack[i - 1].from < from[k]; --i) stack[i] = stack[i - 1];
            stack[i] = {node.child[k], from[k]};
        }
    }
    return best;
}

RingHit Revolution::nearest(const Vec3& point, double reach) const {
    RingHit best{RingHit::kNone, reach, 0.0};
    const double r = point.head<2>().norm();
    for (std::uint32_t k = 0; k < segments_.size(); ++k) {
        const Segment& s = segments_[k];
        const double x = r - s.r, z = point.z() - s.z,
                     along = std::clamp((x * s.dr + z * s.dz) * s.inverse_square, 0.0, 1.0),
                     distance = std::hypot(x - along * s.dr, z - along * s.dz);
        if (s.inverse_square > 0.0 && distance <= best.distance) best = {k, distance, along};
    }
    return best;
}

Vec3 Revolution::normal(std::uint32_t segment) const {
    return {segments_[segment].nr, 0.0, segments_[segment].nz};
}

Turned turned_into_plane(const Vec3& point, const Vec3& direction) {
    const double r = std::sqrt(point.x() * point.x() + point.y() * point.y());
    if (!(r > 0.0)) return {point, direction};
    const double c = point.x() / r, s = point.y() / r;
    return {{r, 0.0, point.z()},
            {c * direction.x() + s * direction.y(), c * direction.y() - s * direction.x(), direction.z()}};
}

double way_to_cylinder(const Vec3& point, const Vec3& direction, double radius) {
    const double a = direction.head<2>().squaredNorm(), b = point.head<2>().dot(direction.head<2>()),
                 c = std::min(0.0, point.head<2>().squaredNorm() - radius * radius);
    if (!(a > 0.0)) return kInfinity;
    const double root = std::sqrt(std::max(0.0, b * b - a * c));
    // The larger root of a t^2 + 2 b t + c = 0, in the form without cancellation.
    return b > 0.0 ? -c / (b + root) : (root - b) / a;
}

}  // namespace sidewall::flux
