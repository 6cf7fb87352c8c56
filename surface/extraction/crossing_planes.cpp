#include "surface/extraction/crossing_planes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace sidewall::surface {
namespace {

// Slopes along a grid edge that differ by less than kSmooth belong to one plane, by more than kKink to two.
constexpr double kSmooth = 0.2, kKink = 0.4;
constexpr double kSamePlace = 0.05;  // cells
constexpr double kPlane = 0.1;       // largest defect of a plane
// If the two best planes differ in cost by less than kAsGood and their gradients have a dot product below
// kApart, the crossing lies on the edge between them.
constexpr double kAsGood = 1e-3, kApart = 0.8;
constexpr double kTie = 1e-5;  // rounding difference of equal numbers

using openvdb::Coord;

Coord step(Coord node, int axis, int by) {
    node[axis] += by;
    return node;
}

// A slope, and the second difference of its stencil.
struct Slope {
    double value, bend;
};

// The slopes at a node along an axis from its low side, its high side and both; NaN where values are unknown.
std::array<Slope, 3> slopes(NodeReader& value, const Coord& node, int axis) {
    const double v = value(node);
    const double low = value(step(node, axis, -1)), high = value(step(node, axis, 1));
    const double bend_low = v - 2.0 * low + value(step(node, axis, -2)), bend = high - 2.0 * v + low,
                 bend_high = value(step(node, axis, 2)) - 2.0 * high + v;
    return {{{v - low + 0.5 * bend_low, std::abs(bend_low)},
             {high - v - 0.5 * bend_high, std::abs(bend_high)},
             {0.5 * (high - low), std::abs(bend)}}};
}

// A plane by the slope along the crossed edge and the best pair of slopes across it.
struct Candidate {
    Vec3 gradient = Vec3::Zero();
    double cost = std::numeric_limits<double>::infinity(), defect = cost;
    bool on_edge = false;  // another plane fits as well
};

Candidate mix(const Candidate& a, const Candidate& b, double share) {
    const double rest = 1.0 - share;
    return {rest * a.gradient + share * b.gradient, rest * a.cost + share * b.cost,
            rest * a.defect + share * b.defect, share < 0.5 ? a.on_edge : b.on_edge};
}

// Mean of two planes, for ties: mirrored wafers stay mirrored.
Candidate mean_of(const Candidate& a, const Candidate& b) {
    return {0.5 * (a.gradient + b.gradient), 0.5 * (a.cost + b.cost), 0.5 * (a.defect + b.defect),
            a.on_edge || b.on_edge};
}

// Candidate planes at one end of a grid edge, by the slopes across the edge, which are found on first use.
class PlanesAt {
  public:
    PlanesAt(NodeReader& value, const Coord& node, int axis) : value_(value), node_(node), axis_(axis) {}

    Candidate best(Slope along) {
        const int u = (axis_ + 1) % 3, v = (axis_ + 2) % 3;
        if (!known_) across_ = {slopes(value_, node_, u), slopes(value_, node_, v)};
        known_ = true;
        Candidate best, other;
        for (const Slope& su : across_[0])
            for (const Slope& sv : across_[1]) {
                const double bend = su.bend + sv.bend + along.bend;
                if (!(bend < other.cost + kTie)) continue;  // neither the best nor the next
                Vec3 g;
                g[axis_] = along.value, g[u] = su.value, g[v] = sv.value;
                const double off = std::abs(g.norm() - 1.0);
                const Candidate here{g, bend + 0.5 * off, bend + 2.0 * off};
                const bool is_better = here.cost < best.cost;  // never with NaN
                if ((g - best.gradient).norm() <= kTie)        // the same plane, found twice
                    best = is_better ? here : best;
                else if (is_better)
                    other = std::exchange(best, here);
                else if (here.cost < other.cost)
                    other = here;
            }
        best.on_edge = other.cost < best.cost + kAsGood && best.gradient.dot(other.gradient) < kApart;
        if (!best.on_edge && other.cost < best.cost + kTie) best = mean_of(best, other);
        return best;
    }

  private:
    NodeReader& value_;
    Coord node_;
    int axis_;
    bool known_ = false;
    std::array<std::array<Slope, 3>, 2> across_{};
};

// The absolute second difference at a node along an axis; 0 where values are unknown.
double bend(NodeReader& value, const Coord& node, int axis) {
    const double b = std::abs(value(step(node, axis, -1)) + value(step(node, axis, 1)) - 2.0 * value(node));
    return std::isnan(b) ? 0.0 : b;
}

}  // namespace

Coord NodeReader::source(Coord node) const {
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const int n = box_.cells[a], period = box_.periodic[a] ? n : 2 * n;
        if (node[axis] >= 0 && node[axis] < n) continue;
        node[axis] = (node[axis] % period + period) % period;
        if (node[axis] > n) node[axis] = period - node[axis];
    }
    return node;
}

double NodeReader::operator()(Coord node) {
    node = source(node);
    const Coord origin = node & ~7;
    if (origin != origin_) {
        origin_ = origin;
        leaf_ = leaves_.leaf_at(node);
    }
    float v;
    if (leaf_ == nullptr || !leaf_->probeValue(node, v)) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(v) / box_.spacing;
}

bool NodeReader::on_seam(const Coord& node) const {
    for (int i = node.x() - 1; i <= node.x() && !box_.columns.empty(); ++i)
        for (int j = node.y() - 1; j <= node.y(); ++j)
            if (i >= 0 && j >= 0 && i < box_.cells[0] && j < box_.cells[1] &&
                column_at(i, j, box_) != CellColumn::meshed)
                return true;
    return false;
}

bool NodeReader::inside(const Coord& node) {
    // Two levels share the nodes on their seam and must decide the same there: by the sign alone.
    const double own = (*this)(node);
    return own < (on_seam(node) ? 0.0 : -on_node());
}

CrossingPlane crossing_plane(NodeReader& value, const Coord& low, int axis) {
    const Coord high = step(low, axis, 1);
    const double a = value(low), b = value(high);
    const double before = a - value(step(low, axis, -1)), behind = value(step(high, axis, 1)) - b,
                 between = b - a;
    const double chord = surface::chord(a, b, value.on_node());  // the zero between the ends by a line
    const bool upwards = value.inside(low);
    const double kink = behind - before;
    // Shares from 0 to 1, gradual so that noise does not make the crossing jump: of_two says how clearly the
    // slopes are those of two planes, meet how clearly these meet on the edge. If they meet beyond its ends,
    // the bend there is as large as the kink.
    const auto share_above = [&](double least) {
        return std::clamp((std::abs(kink) - least) / (kKink - kSmooth), 0.0, 1.0);
    };
    const double of_two = share_above(kSmooth);
    const double meet = of_two > 0.0 && share_above(kKink) < 1.0
                            ? share_above(std::clamp(std::max(bend(value, step(low, axis, -1), axis),
                                                              bend(value, step(high, axis, 1), axis)),
                                                     kSmooth, kKink))
                            : of_two;
    const auto zero = [&](double from, double at, double slope) {
        if (!(slope * between > 0.0)) return -1.0;
        // A surface along the edge, tilted by rounding, has its zero far beyond it.
        const double beyond = std::abs(at - from / slope - 0.5);
        return beyond < 1.5 ? std::clamp(at - from / slope, 0.0, 1.0) : -1.0;
    };
    const double by_low = zero(a, 0.0, before), by_high = zero(b, 1.0, behind);
    PlanesAt at_low(value, low, axis), at_high(value, high, axis);
    // The plane by the slope between the ends, at the node nearer to the crossing unless the other one fits
    // far better.
    const auto linear = [&] {
        const double bent = std::isnan(kink) ? 0.0 : 0.5 * std::abs(kink) * (1.0 - of_two);
        if (std::abs(chord - 0.5) < kTie) {
            const Candidate l = at_low.best({between, bent}), h = at_high.best({between, bent});
            return std::abs(l.cost - h.cost) < kTie ? mean_of(l, h) : l.cost < h.cost ? l : h;
        }
        const bool low_first = chord < 0.5;
        Candidate near = (low_first ? at_low : at_high).best({between, bent});
        if (near.cost < kSamePlace) return near;
        const Candidate far = (low_first ? at_high : at_low).best({between, bent});
        return far.cost < near.cost - kSamePlace ? far : near;
    };
    CrossingPlane plane;
    Candidate best;
    if (meet > 0.0 && (by_low >= 0.0 || by_high >= 0.0)) {
        // At a convex kink phi is the greater of both lines, whose zero is the one nearer to the inside.
        const bool take_smaller = upwards == (kink > 0.0);
        bool use_low =
            by_high < 0.0 || (by_low >= 0.0 && (take_smaller ? by_low < by_high : by_low > by_high));
        const Candidate l = at_low.best({before, 0.0}), h = at_high.best({behind, 0.0});
        // If both zeros coincide, as at a node on the surface, the plane of lower cost counts.
        if (by_low >= 0.0 && by_high >= 0.0 && std::abs(by_low - by_high) < kSamePlace)
            use_low = l.cost < h.cost;
        // A kink between the ends moves the zero from the chord outwards (convex) or inwards (hollow). A zero
        // on the other side comes from curvature: the chord counts.
        plane.at = take_smaller ? std::max(use_low ? by_low : by_high, chord)
                                : std::min(use_low ? by_low : by_high, chord);
        best = use_low ? l : h;
        // Between two kinks the slope is that of one plane, unless the surface continues along the edge.
        const auto runs_on = [](double at, double slope) {
            return std::abs(at) < kPlane && std::abs(slope) < kPlane;
        };
        if (best.defect > kPlane && !runs_on(a, before) && !runs_on(b, behind))
            if (const Candidate middle = linear(); middle.defect < kPlane) plane.at = chord, best = middle;
        if (meet < 1.0 && plane.at != chord) {
            plane.at = chord + meet * (plane.at - chord);
            best = mix(linear(), best, meet);
        }
    } else {
        plane.at = chord;
        best = linear();
    }
    plane.on_edge = best.on_edge;
    if (best.on_edge) best = {};
    plane.at = std::clamp(plane.at, kNodeClearance, 1.0 - kNodeClearance);
    const double length = best.gradient.norm();
    plane.defect = length > 0.0 ? best.defect : std::numeric_limits<double>::infinity();
    if (length > 0.0) plane.normal = best.gradient / length;
    return plane;
}

}  // namespace sidewall::surface
