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

// With more facets, samples of rays reach the usual errors sooner.
constexpr std::size_t kMostFacets = 2000;
constexpr double kNarrowestSource = 300.0;  // exponent: shadows of narrower sources are sharper than facets
constexpr double kShort = 0.5;              // segments of less than this share of the mean area get one point
constexpr double kNarrowest = 1e-12;        // least width of an interval, as a difference of sines
constexpr int kMostImages = 8;              // images of the profile to each side
constexpr double kWide = 0.05;  // width, in sines, above which the place is averaged, not taken at the middle

// A segment seen from a point. Coordinates are across the normal (x) and along it (z) from the point;
// directions are given by the sine of the angle to the normal.
struct Seen {
    Vec2 begin, end;
    double from, to;
    std::uint32_t segment;
    bool is_back;  // turned away from the point: if it is seen first, there is a hole or an overlap

    // Whether it is nearer than another one in the direction of sine \p s and cosine \p c that crosses both.
    bool is_before(const Seen& other, double s, double c) const {
        const Vec2 way = end - begin, others = other.end - other.begin;
        return std::abs(cross(begin, way) * cross({s, c}, others)) <
               std::abs(cross(other.begin, others) * cross({s, c}, way));
    }
    // Place on the segment in the direction of sine \p s: 0 at its beginning, 1 at its end.
    double place(double s) const {
        const Vec2 towards{s, std::sqrt(std::max(0.0, 1.0 - s * s))};
        return std::clamp(cross(towards, begin) / cross(end - begin, towards), 0.0, 1.0);
    }
    // Mean place between two sines: x = h tan(phi), measured from the foot of the perpendicular of length h,
    // is integrated over the sine, whose differential is a combination of cos(phi) dphi and sin(phi) dphi.
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

// An interval of sines in which the same segment is seen; it ends where the next begins.
struct Part {
    double from;
    std::uint32_t seen;  // or kSky
};

// Everything that a point sees: intervals of directions with the nearest segment in each.
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
        // More images are needed only while a free direction has not risen above the profile, e.g. below a
        // floating body: a ray that passes a whole image of a continuous surface is above all images.
        for (images_ = 0; images_ < kMostImages && any_sky_within(); ++images_) {
            see(-images_ - 1, own);
            see(images_ + 1, own);
        }
    }
    // What lies at sine \p s if no segment is seen there: sky, a hole, or images not yet added.
    enum class Open { sky, hole, farther };
    Open open(double s) const {
        const Vec2 way = direction(s);
        if (way.z < 0.0 && is_below(way, lowest_ - least_)) return Open::hole;
        return way.z < 0.0 || is_below(way, highest_) ? Open::farther : Open::sky;
    }
    // Calls use(from, to, segment seen or nullptr) for the intervals from left to right.
    template <class Use>
    void each_part(const Use& use) const {
        for (std::size_t k = 0; k + 1 < parts_.size(); ++k)
            if (parts_[k + 1].from - parts_[k].from > kNarrowest)
                use(parts_[k].from, parts_[k + 1].from,
                    parts_[k].seen == kSky ? nullptr : &seen_[parts_[k].seen]);
    }
    // The direction (x, z) whose angle to the normal has the sine \p s.
    Vec2 direction(double s) const {
        const double c = std::sqrt(std::max(0.0, 1.0 - s * s));
        return {s * normal_.z + c * normal_.x, c * normal_.z - s * normal_.x};
    }

  private:
    // Adds the segments of an image that lie in front of the point, those turned away from it included.
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
        // Runs from left to right: segments that face the point appear in reverse order, in mirror images in
        // order; segments turned away the other way round.
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

    // Merges a run of adjoining segments, those from \p first on, into the intervals: the nearest is seen.
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

    // Sine of the direction to \p at, or to where the segment from it to \p other rises above the own facet.
    double sine(std::uint32_t at, std::uint32_t other) const {
        const Vec2 end = local_[at];
        if (end.z > least_) return sine_[at];
        const double t = (least_ - end.z) / (local_[other].z - end.z),
                     x = end.x + t * (local_[other].x - end.x);
        return x / std::hypot(x, least_);
    }

    // Whether a ray in direction \p way is below \p height where it leaves the outermost image seen.
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
    int images_ = 0;  // images seen to each side
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

// A quadrature point of a segment, its area, and shares of its diffuse emission.
struct Point {
    std::uint32_t segment;
    double along, area;
    double sky = 0.0, leaked = 0.0;
    std::vector<double> direct;  // direct flux of each source
    std::uint64_t parts = 0;
};

// Distance from the middle of a segment to the nearest segment along its normal.
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

// Quadrature points: two a segment by Gauss' rule, one on a short one, more if segments are few or long
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

// Factor of cos^(n - 1), by the angle of paths projected into the plane, in the ratio of a cos^n source to a
// thermal one: 2 over the integral of cos^n from -pi / 2 to pi / 2.
double lobe_scale_in_plane(double n) {
    return 2.0 * std::numbers::inv_sqrtpi *
           std::exp(std::lgamma(0.5 * n + 1.0) - std::lgamma(0.5 * (n + 1.0)));
}

// Adds the sky between two sines; direct flux is integrated by Gauss' rule between the \p angles.
void add_sky(const View& view, double from, double to, std::span<const double> exponents,
             const std::vector<double>& angles, std::vector<double>& bounds, Point& found) {
    const double share = 0.5 * (to - from);
    const View::Open open = view.open(0.5 * (from + to));
    if (open == View::Open::hole) found.leaked += share;
    if (open != View::Open::sky) return;  // beyond the last image: lost here, restored by the balancing
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

// Adds the interval's share of a segment to the row of unknowns.
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
    // Symmetric mean: both directions of a pair differ by rounding and quadrature.
    view.exchange = (0.5 * (view.exchange + view.exchange.transpose())).eval();
    return view;
}

}  // namespace sidewall::flux
