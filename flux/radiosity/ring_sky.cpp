#include "flux/radiosity/ring_sky.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "flux/radiosity/profile_outline.hpp"
#include "surface/error.hpp"
#include "surface/infinity.hpp"
#include "surface/parallel.hpp"

namespace sidewall::flux {
namespace {

constexpr int kAzimuths = 32;       // azimuths in half a turn
constexpr int kMostMirrorings = 8;  // reflections at the cylinder around the domain
constexpr double kMostPieces = 16;  // most quadrature pieces of a ring that is long beside the others

// A binary hierarchy over the outline's segments, numbered as a heap. Paths are seen from above: a straight
// path whose nearest point to the axis ("middle") is at a distance b from it, passes over the radius r at
// sqrt(r^2 - b^2) from the middle, on either side.
class Rings {
  public:
    explicit Rings(const Outline& outline) : outline_(outline), nodes_(4 * outline.segments.size() + 4) {
        build(0, 0, outline.segments.size());
    }

    // Intervals of slopes (lower, upper) at which the sky is seen in a half plane through \p point.
    // \param cosine  of the azimuth, relative to the direction away from the axis.
    // \param radius  of the reflective cylinder.
    // \param open    intervals to begin with; those hidden by rings are removed.
    using Slopes = std::vector<std::pair<double, double>>;
    void look(Vec2 point, double cosine, double radius, Slopes& open) const {
        Look look{point, point.x * std::sqrt(1.0 - cosine * cosine), -point.x * cosine, open};
        const double half = std::sqrt(std::max(0.0, radius * radius - look.off * look.off));
        for (int n = 0; n <= kMostMirrorings && half > 0.0 && !open.empty(); ++n, look.middle += 2.0 * half) {
            const double steepest = n > 0 ? (nodes_[0].high - point.z) / (look.middle - half) : kInfinity;
            if (n > 0 && !look.any(0.0, steepest)) break;
            for (const double side : {-1.0, 1.0}) hide(look, side, 0, 0, outline_.segments.size());
        }
    }

  private:
    struct Node {
        double inner = kInfinity, outer = 0.0, low = kInfinity, high = -kInfinity;
        bool joined = true;  // whether its segments form one line
    };
    struct Look {
        Vec2 point;
        double off;     // distance of the path from the axis
        double middle;  // signed distance from the point to the path's middle
        Slopes& open;
        bool any(double from, double to) const {
            return std::ranges::any_of(open, [&](const auto& o) { return o.first < to && from < o.second; });
        }
        void take(double one, double other) const {
            const double from = std::min(one, other), to = std::max(one, other);
            for (auto k = std::ssize(open); k-- > 0;) {
                const auto [first, second] = open[static_cast<std::size_t>(k)];
                if (!(first < to && from < second)) continue;
                open.erase(open.begin() + k);
                if (to < second) open.insert(open.begin() + k, {to, second});
                if (first < from) open.insert(open.begin() + k, {first, from});
            }
        }
        // Distance from the middle to where the path passes over a radius.
        double half_chord(double r) const { return std::sqrt(std::max(0.0, r * r - off * off)); }
    };

    void build(std::size_t at, std::size_t first, std::size_t last) {
        Node& node = nodes_[at];
        for (std::size_t k = first; k < last; ++k) {
            for (const std::uint32_t end : outline_.segments[k].end) {
                const Vec2 p = outline_.points[end];
                node.inner = std::min(node.inner, p.x), node.outer = std::max(node.outer, p.x);
                node.low = std::min(node.low, p.z), node.high = std::max(node.high, p.z);
            }
            node.joined =
                node.joined && (k == first || outline_.segments[k - 1].end[1] == outline_.segments[k].end[0]);
        }
        if (last - first < 2) return;
        build(2 * at + 1, first, (first + last) / 2);
        build(2 * at + 2, (first + last) / 2, last);
    }

    // Removes the slopes that a node's segments hide where the path passes them on one \p side of its middle.
    void hide(const Look& look, double side, std::size_t at, std::size_t first, std::size_t last) const {
        const Node& node = nodes_[at];
        if (node.high <= look.point.z || node.outer <= look.off) return;
        const double inner = look.half_chord(node.inner), outer = look.half_chord(node.outer),
                     from = look.middle + (side > 0.0 ? inner : -outer),
                     to = look.middle + (side > 0.0 ? outer : -inner);
        if (to <= 0.0) return;
        const double steepest = from > 0.0 ? (node.high - look.point.z) / from : kInfinity,
                     flattest = std::max(0.0, node.low - look.point.z) / to;
        if (!look.any(flattest, steepest)) return;
        if (last - first == 1) return hide_segment(look, side, outline_.segments[first]);
        if (node.joined && node.inner >= look.off && from > 0.0) {  // one line hides all between its ends
            const auto slope = [&](std::uint32_t end) {
                const Vec2 p = outline_.points[end];
                return (p.z - look.point.z) / (look.middle + side * look.half_chord(p.x));
            };
            look.take(slope(outline_.segments[first].end[0]), slope(outline_.segments[last - 1].end[1]));
            if (!look.any(flattest, steepest)) return;
        }
        const std::size_t half = (first + last) / 2;
        hide(look, side, 2 * at + 1, first, half);
        hide(look, side, 2 * at + 2, half, last);
    }
    void hide_segment(const Look& look, double side, const Segment& segment) const {
        Vec2 a = outline_.points[segment.end[0]], b = outline_.points[segment.end[1]];
        if (a.x > b.x) std::swap(a, b);
        // Near the middle the path passes over the segment in a curve: use four chords.
        const int pieces = a.x < look.off ? 4 : 1;
        if (a.x < look.off) a = {look.off, a.z + (look.off - a.x) / (b.x - a.x) * (b.z - a.z)};
        const double inner = look.half_chord(a.x), outer = look.half_chord(b.x);
        Vec2 before{look.middle + side * inner, a.z - look.point.z};
        for (int k = 1; k <= pieces; ++k) {
            const double chord = inner + (outer - inner) * k / pieces,
                         part = k == pieces ? 1.0 : (std::hypot(chord, look.off) - a.x) / (b.x - a.x);
            const Vec2 here{look.middle + side * chord, a.z + part * (b.z - a.z) - look.point.z};
            if (before.x > 0.0 && here.x > 0.0) {
                look.take(before.z / before.x, here.z / here.x);
            } else if (before.x > 0.0 || here.x > 0.0) {  // the piece passes above or below the point
                const Vec2 ahead = before.x > 0.0 ? before : here;
                const double over = a.z + (look.point.x - a.x) / (b.x - a.x) * (b.z - a.z) - look.point.z;
                look.take(over > 0.0 ? kInfinity : -kInfinity, ahead.z / ahead.x);
            }
            before = here;
        }
    }

    const Outline& outline_;
    std::vector<Node> nodes_;
};

// Integrates the open sky of a half plane: leaving emission, and direct flux of every source.
class Sky {
  public:
    explicit Sky(std::span<const double> exponents) : exponents_(exponents) {
        for (const double angle : angles_of(exponents))
            if (angle >= 0.0) bounds_.push_back(0.5 * std::numbers::pi - angle);
        for (int k = 1; k <= 20 && std::ranges::any_of(exponents, [](double n) { return n < 1.0; }); ++k)
            bounds_.push_back(std::exp2(-k));
        std::ranges::sort(bounds_);
    }
    // Adds the sky between two slopes. \p across: radial part of the normal times the azimuth's cosine;
    // \p up: its vertical part.
    void add(double from, double to, double across, double up, double& leaving,
             std::vector<double>& direct) const {
        const auto sum = [&](double angle) {
            const double s = std::sin(angle);
            return 0.5 * (across * (angle + s * std::cos(angle)) + up * s * s);
        };
        const double first = std::atan(from), last = std::atan(to), thermal = sum(last) - sum(first);
        leaving += thermal;
        for (std::size_t k = 0; k < exponents_.size(); ++k) {
            if (exponents_[k] == 1.0) {
                direct[k] += thermal;
                continue;
            }
            double low = first;
            for (std::size_t n = 0; n <= bounds_.size(); ++n) {
                const double high = n < bounds_.size() ? std::min(last, bounds_[n]) : last;
                if (high <= low) continue;
                for (const double place :
                     {0.5 * kGauss, 0.5 - 0.5 * kGauss, 0.5 + 0.5 * kGauss, 1.0 - 0.5 * kGauss}) {
                    const double angle = low + place * (high - low), s = std::sin(angle), c = std::cos(angle);
                    direct[k] += 0.25 * (high - low) * c * (across * c + up * s) * lobe_scale(exponents_[k]) *
                                 lobe(exponents_[k], s);
                }
                low = high;
            }
        }
    }

  private:
    std::span<const double> exponents_;
    std::vector<double> bounds_;  // elevations (radian) between which every law is close to a cubic
};

// A quadrature point of a ring.
struct RingPoint {
    std::uint32_t segment;
    double along, area;
    double leaving = 0.0;
    std::vector<double> direct{};  // direct flux of each source
};

// Quadrature points: two a ring by Gauss' rule, more on long rings.
std::vector<RingPoint> ring_points(const Outline& outline) {
    std::vector<RingPoint> points;
    std::vector<double> lengths;
    double mean = 0.0;
    for (const Segment& one : outline.segments) {
        const Vec2 way = outline.points[one.end[1]] - outline.points[one.end[0]];
        lengths.push_back(std::hypot(way.x, way.z));
        mean += lengths.back() / static_cast<double>(outline.segments.size());
    }
    for (std::uint32_t i = 0; i < lengths.size(); ++i) {
        const Segment& one = outline.segments[i];
        const double pieces = std::clamp(std::ceil(0.5 * lengths[i] / mean), 1.0, kMostPieces),
                     middle = 0.5 * (outline.points[one.end[0]].x + outline.points[one.end[1]].x);
        for (double piece = 0.0; piece < pieces; ++piece)
            for (const double place : {kGauss, 1.0 - kGauss}) {
                const double along = (piece + place) / pieces;
                points.push_back({i, along, one.area * 0.5 / pieces * outline.at(one, along).x / middle});
            }
    }
    return points;
}

}  // namespace

RingSky sky_of_rings(const Geometry& geometry, const ProfileUnknowns& profile,
                     std::span<const double> exponents, const std::function<bool()>& stop) {
    const Outline outline = outline_of(geometry.mesh, profile);
    const Rings rings(outline);
    const Sky sky(exponents);
    std::vector<RingPoint> points = ring_points(outline);
    std::atomic<bool> stopped{false};
    surface::parallel_each(points.size(), 16, [&](std::size_t n) {
        if (stopped || (stop && stop())) {
            stopped = true;
            return;
        }
        RingPoint& point = points[n];
        point.direct.assign(exponents.size(), 0.0);
        const Segment& own = outline.segments[point.segment];
        Vec2 place = outline.at(own, point.along);
        place = {std::max(0.0, place.x + geometry.skin * own.normal.x),
                 place.z + geometry.skin * own.normal.z};
        Rings::Slopes open;
        for (int k = 0; k < kAzimuths; ++k) {
            const double cosine = std::cos(std::numbers::pi * (k + 0.5) / kAzimuths),
                         across = own.normal.x * cosine, up = own.normal.z;
            // Slopes in front of the ring's tangent plane, and not below the horizon.
            const double edge = up == 0.0 ? (across > 0.0 ? -kInfinity : kInfinity) : -across / up;
            const double lowest = up < 0.0 ? 0.0 : std::max(0.0, edge), highest = up < 0.0 ? edge : kInfinity;
            if (!(lowest < highest)) continue;
            open.assign(1, {lowest, highest});
            rings.look(place, cosine, geometry.box.max[0], open);
            for (const auto& [from, to] : open) sky.add(from, to, across, up, point.leaving, point.direct);
        }
    });
    if (stopped) throw Interrupted("interrupted while finding what a profile sees of the sky");

    RingSky result;
    result.leaving.assign(profile.unknowns.count(), 0.0);
    for (const double n : exponents) result.direct[n] = result.leaving;
    for (const RingPoint& point : points) {
        const Segment& own = outline.segments[point.segment];
        const double area = point.area * 2.0 / kAzimuths;
        const Vec3& first = geometry.mesh.vertices[geometry.mesh.triangles[own.triangle][0]];
        const Vec2 begin = outline.points[own.end[0]];
        const double along = begin.x == first.x() && begin.z == first.z() ? point.along : 1.0 - point.along;
        if (point.leaving > 0.0)
            result.exits.push_back({own.triangle, static_cast<float>(0.5 * along),
                                    static_cast<float>(0.5 * along), static_cast<float>(area * point.leaving),
                                    1.0f});
        for (std::size_t end = 0; end < 2; ++end) {
            const double weight = area * (end == 0 ? 1.0 - point.along : point.along);
            result.leaving[own.unknown[end]] += weight * point.leaving;
            for (std::size_t k = 0; k < exponents.size(); ++k)
                result.direct[exponents[k]][own.unknown[end]] += weight * point.direct[k];
        }
    }
    return result;
}

}  // namespace sidewall::flux
