#include "flux/radiosity/profile_view.hpp"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/radiosity/profile_outline.hpp"
#include "surface/error.hpp"
#include "surface/parallel.hpp"

namespace sidewall::flux {
namespace {

// Above so many facets samples of rays are sooner as exact as anyone asks for.
constexpr std::size_t kMostFacets = 2000;
constexpr double kNarrowestSource = 300.0;  // exponent: shadows of narrower ones are sharper than facets
constexpr double kShort = 0.5;              // segments shorter than this part of the mean have one point
constexpr double kNarrowest = 1e-12;        // parts, by their sines, that are left out
constexpr int kMostImages = 8;              // of the profile, either way
constexpr double kWide = 0.05;  // over a part so wide the place is averaged, else taken at its middle

// A segment as a point sees it: across the normal (x) and along it (z), and the sines between which it is.
struct Seen {
    Vec2 begin, end;
    double from, to;
    std::uint32_t segment;
    bool is_back;  // turned away from the point: seen first, it is a hole or an overlap

    // Whether it is nearer than another one in the direction of sine \p s and cosine \p c, both of which it
    // crosses.
    bool is_before(const Seen& other, double s, double c) const {
        const Vec2 way = end - begin, others = other.end - other.begin;
        return std::abs(cross(begin, way) * cross({s, c}, others)) <
               std::abs(cross(other.begin, others) * cross({s, c}, way));
    }
    // The place along it in the direction of sine \p s, 0 at its beginning and 1 at its end.
    double place(double s) const {
        const Vec2 towards{s, std::sqrt(std::max(0.0, 1.0 - s * s))};
        return std::clamp(cross(towards, begin) / cross(end - begin, towards), 0.0, 1.0);
    }
    // The mean place between two sines. With the foot of the perpendicular from the point, of length h,
    // places x = h tan(phi) along the segment are integrated over the sine, whose differential is a
    // combination of cos(phi) and sin(phi) times that of phi.
    double mean_place(double from_sine, double to_sine) const {
        const Vec2 way = end - begin;
        const double length = std::hypot(way.x, way.z), rise = way.z / length;
        const double foot = (begin.x * way.x + begin.z * way.z) / length;
        const double height = std::abs(cross(begin, way)) / length, up = (begin.z - foot * rise) / height;
        const auto integrals = [&](double s) {
            const double x = place(s) * length + foot, r = std::hypot(x, height);
            return Vec2{height * (rise * (std::asinh(x / height) - x / r) - up * height / r),
                        up * x / r - rise * height / r};
        };
        const Vec2 sum = integrals(to_sine) - integrals(from_sine);
        return std::clamp((sum.x / sum.z - foot) / length, 0.0, 1.0);
    }
};

constexpr std::uint32_t kSky = 0xffffffffu;

// A part of the directions, by their sines, in which the same is seen first; it ends where the next begins.
struct Part {
    double from;
    std::uint32_t seen;  // or kSky
};

// What a point sees.
class View {
  public:
    View(const Geometry& geometry, const Outline& outline)
        : box_(geometry.box), outline_(outline), local_(outline.points.size()), sine_(outline.points.size()) {
        for (const Vec2& point : outline.points) {
            highest_ = std::max(highest_, point.z);
            lowest_ = std::min(lowest_, point.z);
        }
        least_ = 1e-9 * (box_.max[0] - box_.min[0]);
    }

    // Finds what is seen from a \p point on the segment \p own.
    void look(Vec2 point, std::uint32_t own) {
        point_ = point;
        normal_ = outline_.segments[own].normal;
        seen_.clear();
        parts_ = {{-1.0, kSky}, {1.0, kSky}};
        see(0, own);
        // Whatever passes one image of a surface from side to side is above all of them. Between bodies that
        // float and what is under them, sight goes on.
        for (images_ = 0; images_ < kMostImages && any_sky_within(); ++images_) {
            see(-images_ - 1, own);
            see(images_ + 1, own);
        }
    }
    // What the direction of sine \p s comes to where nothing is seen in it.
    enum class Open { sky, hole, farther };
    Open open(double s) const {
        const Vec2 way = direction(s);
        if (way.z < 0.0 && is_below(way, lowest_ - least_)) return Open::hole;
        return way.z < 0.0 || is_below(way, highest_) ? Open::farther : Open::sky;
    }
    // Calls use(from, to, what is seen or nullptr for the sky) for the parts from left to right.
    template <class Use>
    void each_part(const Use& use) const {
        for (std::size_t k = 0; k + 1 < parts_.size(); ++k)
            if (parts_[k + 1].from - parts_[k].from > kNarrowest)
                use(parts_[k].from, parts_[k + 1].from,
                    parts_[k].seen == kSky ? nullptr : &seen_[parts_[k].seen]);
    }
    // The direction of sine \p s to the normal.
    Vec2 direction(double s) const {
        const double c = std::sqrt(std::max(0.0, 1.0 - s * s));
        return {s * normal_.z + c * normal_.x, c * normal_.z - s * normal_.x};
    }

  private:
    // Adds the segments of an image that face the point and lie before it.
    void see(int image, std::uint32_t own) {
        const bool mirrored = image % 2 != 0 && box_.boundary[0] == Boundary::reflective;
        const double width = box_.max[0] - box_.min[0], flip = mirrored ? -1.0 : 1.0;
        const double shift = image * width + (mirrored ? box_.min[0] + box_.max[0] : 0.0);
        for (std::size_t i = 0; i < local_.size(); ++i) {
            const double x = shift + flip * outline_.points[i].x - point_.x,
                         z = outline_.points[i].z - point_.z;
            const double across = x * normal_.z - z * normal_.x, along = x * normal_.x + z * normal_.z;
            local_[i] = {across, along};
            sine_[i] = across / std::sqrt(across * across + along * along);
        }
        // From left to right: those that face the point against their order, or with it in a mirror, and
        // those turned away the other way round.
        const auto count = static_cast<std::uint32_t>(outline_.segments.size());
        for (const bool back : {false, true}) {
            const bool forward = mirrored != back;
            std::size_t first = seen_.size();
            for (std::uint32_t k = 0; k < count; ++k) {
                const std::uint32_t i = forward ? k : count - 1 - k;
                const auto [b, e] = outline_.segments[i].end;
                if ((local_[b].z <= least_ && local_[e].z <= least_) || (image == 0 && i == own)) continue;
                const double from = forward ? sine(b, e) : sine(e, b), to = forward ? sine(e, b) : sine(b, e);
                if (!(to - from > kNarrowest)) continue;
                if (seen_.size() > first && seen_.back().to != from) merge(first), first = seen_.size();
                seen_.push_back({local_[b], local_[e], from, to, i, back});
            }
            merge(first);
        }
    }

    // Lets the segments from \p first on, each of which begins where the one before it ends, hide what is
    // behind them.
    void merge(std::size_t first) {
        if (first == seen_.size()) return;
        const double from = seen_[first].from, to = seen_.back().to;
        const auto begin = std::ranges::upper_bound(parts_, from, {}, &Part::from) - 1;
        auto old = begin;
        merged_.clear();
        if (begin->from < from) merged_.push_back(*begin);
        auto next = static_cast<std::uint32_t>(first);
        for (double at = from; at < to;) {
            const double old_to = (old + 1)->from, end = std::min(old_to, seen_[next].to);
            const std::uint32_t nearest =
                old->seen == kSky || is_before(next, old->seen, 0.5 * (at + end)) ? next : old->seen;
            if (merged_.empty() || merged_.back().seen != nearest) merged_.push_back({at, nearest});
            if (end == old_to) ++old;
            if (end == seen_[next].to) ++next;
            at = end;
        }
        if (old->from < to && merged_.back().seen != old->seen) merged_.push_back({to, old->seen});
        if (old->from < to) ++old;
        const auto place = std::copy_n(merged_.begin(), std::min(std::ssize(merged_), old - begin), begin);
        if (old - begin > std::ssize(merged_))
            parts_.erase(place, old);
        else
            parts_.insert(place, merged_.begin() + (old - begin), merged_.end());
    }
    bool is_before(std::uint32_t one, std::uint32_t other, double s) const {
        return seen_[one].is_before(seen_[other], s, std::sqrt(1.0 - s * s));
    }

    // Of the direction to a point, or to where the segment from it to \p other rises above the view's own
    // facet.
    double sine(std::uint32_t at, std::uint32_t other) const {
        const Vec2 end = local_[at];
        if (end.z > least_) return sine_[at];
        const double t = (least_ - end.z) / (local_[other].z - end.z),
                     x = end.x + t * (local_[other].x - end.x);
        return x / std::hypot(x, least_);
    }

    // Whether a way has not risen to a height, or has sunk below it, at the end of the images seen.
    bool is_below(Vec2 way, double height) const {
        const double to_side = way.x > 0.0 ? box_.max[0] - point_.x : point_.x - box_.min[0];
        const double across = to_side + images_ * (box_.max[0] - box_.min[0]);
        return (point_.z - height + least_) * std::abs(way.x) + across * way.z < 0.0;
    }
    bool any_sky_within() const {
        bool any = false;
        each_part([&](double from, double to, const Seen* seen) {
            any = any || (seen == nullptr && (open(from) == Open::farther || open(to) == Open::farther));
        });
        return any;
    }

    const LateralBox& box_;
    const Outline& outline_;
    double highest_ = -1e300, lowest_ = 1e300, least_;
    int images_ = 0;  // either way
    Vec2 point_{}, normal_{};
    std::vector<Vec2> local_;  // the outline's points
    std::vector<double> sine_;
    std::vector<Seen> seen_;
    std::vector<Part> parts_, merged_;
};

}  // namespace

std::vector<double> angles_of(std::span<const double> exponents) {
    std::vector<double> angles;
    for (const double n : exponents) {
        if (n == 1.0) continue;
        for (int k = -8; k <= 8; ++k) angles.push_back(k * std::numbers::pi / 16.0);
        const double width = 1.0 / std::sqrt(std::max(1.0, n));
        for (int k = -6; k <= 6; ++k)
            if (k * width < 0.5 * std::numbers::pi && k * width > -0.5 * std::numbers::pi)
                angles.push_back(k * width);
    }
    std::ranges::sort(angles);
    return angles;
}

namespace {

// A point of a segment, the area that it stands for, and shares of what it emits by Lambert's law.
struct Point {
    std::uint32_t segment;
    double along, area;
    double sky = 0.0, leaked = 0.0;
    std::vector<double> direct;  // of each source
    std::uint64_t parts = 0;
};

// The distance from the middle of a segment to what lies straight ahead.
double ahead(const Outline& outline, std::uint32_t own) {
    const Segment& one = outline.segments[own];
    const Vec2 middle = outline.at(one, 0.5);
    double nearest = 1e300;
    for (std::uint32_t i = 0; i < outline.segments.size(); ++i) {
        const Vec2 begin = outline.points[outline.segments[i].end[0]] - middle,
                   end = outline.points[outline.segments[i].end[1]] - middle;
        const double from = cross(begin, one.normal), to = cross(end, one.normal);
        if (i == own || (from < 0.0) == (to < 0.0)) continue;
        const Vec2 met{begin.x + from / (from - to) * (end.x - begin.x),
                       begin.z + from / (from - to) * (end.z - begin.z)};
        const double distance = met.x * one.normal.x + met.z * one.normal.z;
        if (distance > 0.0) nearest = std::min(nearest, distance);
    }
    return nearest;
}

// Two a segment by Gauss' rule, but one in the middle of short ones, and more where segments are few or long
// beside the distance to what they face.
std::vector<Point> points_on(const Outline& outline, std::size_t sources) {
    constexpr double kMostPieces = 16.0, kLeastOfAll = 64.0;
    const std::vector<Segment>& segments = outline.segments;
    double mean = 0.0;
    for (const Segment& one : segments) mean += one.area / static_cast<double>(segments.size());
    const double least = std::min(kMostPieces, std::ceil(kLeastOfAll / static_cast<double>(segments.size())));
    std::vector<Point> points;
    for (std::uint32_t i = 0; i < segments.size(); ++i) {
        const double area = segments[i].area;
        const Vec2 way = outline.points[segments[i].end[1]] - outline.points[segments[i].end[0]];
        const double pieces =
            std::clamp(std::ceil(0.5 * std::hypot(way.x, way.z) / ahead(outline, i)), least, kMostPieces);
        const auto add = [&](double along, double share) {
            points.push_back({i, along, share * area, 0.0, 0.0, std::vector<double>(sources)});
        };
        if (area < kShort * mean && pieces == 1.0)
            add(0.5, 1.0);
        else
            for (double piece = 0.0; piece < pieces; ++piece)
                for (const double along : {kGauss, 1.0 - kGauss}) add((piece + along) / pieces, 0.5 / pieces);
    }
    return points;
}

// A source cos^n relative to a thermal one, by the angle of paths that are projected into the plane: this
// times cos^(n - 1), namely 2 over the integral of cos^n from -pi / 2 to pi / 2.
double lobe_scale_in_plane(double n) {
    return 2.0 * std::numbers::inv_sqrtpi *
           std::exp(std::lgamma(0.5 * n + 1.0) - std::lgamma(0.5 * (n + 1.0)));
}

// Adds the sky between two sines, by Gauss' rule between the \p angles.
void add_sky(const View& view, double from, double to, std::span<const double> exponents,
             const std::vector<double>& angles, std::vector<double>& bounds, Point& found) {
    const double share = 0.5 * (to - from);
    const View::Open open = view.open(0.5 * (from + to));
    if (open == View::Open::hole) found.leaked += share;
    if (open != View::Open::sky) return;  // a little that is too far to be seen leaves with the balance
    found.sky += share;
    if (angles.empty()) {  // all sources are thermal
        for (double& direct : found.direct) direct += share;
        return;
    }
    // The vertical's angle to the normal.
    const double vertical = std::atan2(view.direction(1.0).z, view.direction(0.0).z);
    const double first = std::asin(from), last = std::asin(to);
    bounds.assign({first, last});
    for (const double angle : angles)
        if (vertical + angle > first && vertical + angle < last) bounds.push_back(vertical + angle);
    std::ranges::sort(bounds);
    for (std::size_t i = 0; i + 1 < bounds.size(); ++i)
        for (const double place : {kGauss, 1.0 - kGauss}) {
            const double width = bounds[i + 1] - bounds[i], angle = bounds[i] + place * width;
            const double rise = std::cos(angle - vertical);
            for (std::size_t n = 0; n < exponents.size() && rise > 0.0; ++n)
                found.direct[n] += 0.25 * width * std::cos(angle) * lobe_scale_in_plane(exponents[n]) *
                                   lobe(exponents[n], rise);
        }
}

// Adds what is seen of a segment to the row of unknowns.
void add_part(const Seen& seen, double from, double to, const Segment& segment, double* row) {
    const double share = 0.5 * (to - from);
    const double along = to - from < kWide ? seen.place(0.5 * (from + to)) : seen.mean_place(from, to);
    row[segment.unknown[0]] += share * (1.0 - along);
    row[segment.unknown[1]] += share * along;
}

}  // namespace

bool can_be_viewed(const Geometry& geometry, const ProfileUnknowns& profile,
                   std::span<const double> exponents) {
    return geometry.straight && !profile.partner.empty() && profile.partner.size() <= 2 * kMostFacets &&
           std::ranges::all_of(exponents, [](double n) { return n >= 1.0 && n <= kNarrowestSource; });
}

ProfileView view_profile(const Geometry& geometry, const ProfileUnknowns& profile,
                         std::span<const double> exponents, const std::function<bool()>& stop) {
    const Outline outline = outline_of(geometry.mesh, profile);
    const std::vector<Segment>& segments = outline.segments;
    const std::vector<double> angles = angles_of(exponents);
    std::vector<Point> points = points_on(outline, exponents.size());
    const auto unknowns = static_cast<Eigen::Index>(profile.unknowns.count());
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows =
        Eigen::MatrixXd::Zero(std::ssize(points), unknowns);
    std::atomic<bool> stopped{false};
    tbb::enumerable_thread_specific<View> views([&] { return View(geometry, outline); });
    surface::parallel_each(points.size(), 16, [&](std::size_t n) {
        if (stopped || (stop && stop())) {
            stopped = true;
            return;
        }
        View& view = views.local();
        std::vector<double> bounds;
        Point& point = points[n];
        double* row = rows.row(static_cast<Eigen::Index>(n)).data();
        view.look(outline.at(segments[point.segment], point.along), point.segment);
        view.each_part([&](double from, double to, const Seen* seen) {
            ++point.parts;
            if (seen != nullptr && seen->is_back)
                point.leaked += 0.5 * (to - from);
            else if (seen != nullptr)
                add_part(*seen, from, to, segments[seen->segment], row);
            else
                add_sky(view, from, to, exponents, angles, bounds, point);
        });
    });
    if (stopped) throw Interrupted("interrupted while finding what a profile sees");

    ProfileView view;
    double leaked = 0.0, area = 0.0;
    view.exchange = Eigen::MatrixXd::Zero(unknowns, unknowns);
    view.sky.assign(profile.unknowns.count(), 0.0);
    view.direct.assign(exponents.size(), view.sky);
    for (std::size_t n = 0; n < points.size(); ++n) {
        const Point& point = points[n];
        for (std::size_t end = 0; end < 2; ++end) {
            const std::uint32_t u = segments[point.segment].unknown[end];
            const double weight = point.area * (end == 0 ? 1.0 - point.along : point.along);
            view.exchange.col(u) += weight * rows.row(static_cast<Eigen::Index>(n)).transpose();
            view.sky[u] += weight * point.sky;
            for (std::size_t k = 0; k < exponents.size(); ++k) view.direct[k][u] += weight * point.direct[k];
        }
        view.parts += point.parts;
        leaked += point.area * point.leaked;
        area += point.area;
    }
    view.leaked = leaked / area;
    // Each pair of points counts from both: rounding and Gauss' rule differ.
    view.exchange = (0.5 * (view.exchange + view.exchange.transpose())).eval();
    return view;
}

}  // namespace sidewall::flux
