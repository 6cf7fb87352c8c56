#include "app/results/cut_profile.hpp"

#include <algorithm>
#include <cmath>

#include "levelset/layers/stack.hpp"

namespace sidewall::app {
namespace {

// Intervals of material between sorted crossings, where it alternates with gas. \p solid: material is first.
Stretches between(const std::vector<double>& crossings, bool solid) {
    Stretches stretches;
    double begin = -kInfinity;
    for (const double crossing : crossings) {
        if (solid) stretches.emplace_back(begin, crossing);
        begin = crossing;
        solid = !solid;
    }
    if (solid) stretches.emplace_back(begin, kInfinity);
    return stretches;
}

// A profile that varies by less than this part of a cell is flat. It is the thickness below which a film
// counts as none; faces on nodes lie 0.002 of their level's cells off them, which is less on all levels.
constexpr double kFlat = levelset::kExposed;

// z of the profile's lowest, from `least` on, and highest crossing of the vertical at `along`; or kNone.
std::pair<double, double> crossings(const Profile& profile, double along, double least = -kInfinity) {
    std::pair<double, double> found{kNone, kNone};
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        const double a = p.dot(profile.along), b = q.dot(profile.along);
        if (a == b || std::min(a, b) > along || std::max(a, b) < along) return;
        const double z = p.z() + (along - a) / (b - a) * (q.z() - p.z());
        if (z >= least) found = {std::fmin(found.first, z), std::fmax(found.second, z)};
    });
    return found;
}

// The profile with one mirrored or shifted copy beyond each side.
Profile with_beyond(const Profile& profile) {
    Profile all = profile;
    for (const surface::Polyline& line : profile.lines) {
        for (const double side : profile.mirrors) {
            surface::Polyline& copy = all.lines.emplace_back(line);
            for (Vec3& p : copy.points) p += 2.0 * (side - p.dot(profile.along)) * profile.along;
        }
        for (const double shift : profile.shifts) {
            surface::Polyline& copy = all.lines.emplace_back(line);
            for (Vec3& p : copy.points) p += shift * profile.along;
        }
    }
    all.span.reset();
    all.span = span_of_profile(all);
    return all;
}

// The middle of the wider material beside an opening at height z; NaN if neither ends. Of equally wide ones,
// that left of the opening, or right of it where sides are periodic.
double middle_beside(const Profile& profile, const std::pair<double, double>& open, double z) {
    std::pair<double, double> left{kNone, kNone}, right = left;
    for (const auto& [from, to] : solid_at(profile, z)) {
        if (!std::isfinite(to - from)) continue;
        if (to == open.first) left = {from, to};
        if (from == open.second) right = {from, to};
    }
    const double more = (right.second - right.first) - (left.second - left.first),
                 rounding = 1e-6 * (open.second - open.first);
    const bool is_right = more > (profile.shifts.empty() ? rounding : -rounding) || std::isnan(left.first);
    const auto& [from, to] = is_right ? right : left;
    return 0.5 * (from + to);
}

struct Floor {
    double z = kInfinity, along = kNone;
};

// The lowest vertex of a profile within an opening; of those less than \p flat higher, as rounding decides
// which point of a flat floor is the lowest, the one nearest to the opening's middle.
Floor deepest_point(const Profile& below, const std::pair<double, double>& within, double flat = 0.0) {
    Floor deepest;
    const auto off_middle = [&](double at) { return std::abs(2.0 * at - within.first - within.second); };
    for (const bool is_known : {false, true})
        below.each_segment([&](const Vec3& p, const Vec3& q) {
            for (const Vec3* end : {&p, &q}) {
                const double at = end->dot(below.along);
                if (!(at >= within.first && at <= within.second)) continue;
                if (!is_known)
                    deepest.z = std::min(deepest.z, end->z());
                else if (end->z() <= deepest.z + flat && !(off_middle(at) >= off_middle(deepest.along)))
                    deepest.along = at;
            }
        });
    return deepest;
}

// Place along the profile where a floor is measured: midway between its walls one cell above it (at most half
// the depth), as the mesh may have cut a corner of the floor. Without walls: that of its lowest point.
double middle_of_floor(const Profile& below, const Floor& floor, double top, double spacing) {
    for (const auto& [left, right] : openings(below, floor.z + std::min(spacing, 0.5 * (top - floor.z))))
        if (floor.along >= left - spacing && floor.along <= right + spacing) return 0.5 * (left + right);
    return floor.along;
}

// Whether the opening differs by over a tenth between z - near and z + near, as at the ceiling of a cavity.
bool has_ledge(const Profile& profile, double z, double near) {
    const double above = opening(profile, z + near), below = opening(profile, z - near);
    return std::abs(above - below) > 0.1 * std::max(above, below);
}

// Measures the film on top, at `beside`, and on the floor, at `floor_at`; profiles that are not flat include
// their copies beyond the sides. Returns z of the top below the film.
double measure_flats(const Profile& surface, const Profile& below, double beside, double floor_at,
                     double floor, double spacing, Film& film) {
    const double top = crossings(below, beside).second;
    film.top = crossings(surface, beside).second - top;
    // Both heights are taken at one place, as a floor's lowest point may lie in a corner, deeper than its
    // middle. The film's is the lowest crossing of the surface there that is in no void below the floor.
    const double base = crossings(below, floor_at).first;
    film.bottom = crossings(surface, floor_at, base - 0.5 * spacing).first - base;
    if (film.bottom < 0.0) film.bottom = 0.0;  // without a film the meshes round corners differently
    film.depth = top - floor;
    return top;
}

}  // namespace

ProfileSpan span_of_profile(const Profile& profile) {
    if (profile.span) return *profile.span;
    ProfileSpan span;
    for (const surface::Polyline& line : profile.lines)
        for (const Vec3& p : line.points) {
            const double at = p.dot(profile.along);
            span.left = std::min(span.left, at);
            span.right = std::max(span.right, at);
            span.floor = std::min(span.floor, p.z());
            span.crest = std::max(span.crest, p.z());
        }
    for (const surface::Polyline& line : profile.lines) {
        if (line.closed) continue;  // begins at neither end, also if it lies nearest to one
        for (std::size_t k = 1; k < line.points.size(); ++k) {
            const Vec3 &p = line.points[k - 1], &q = line.points[k];
            const double from = p.dot(profile.along), to = q.dot(profile.along);
            if (from == to) continue;
            if (from == span.left || to == span.left)
                span.from_left.push_back((from == span.left ? p : q).z());
            if (from == span.right || to == span.right)
                span.from_right.push_back((from == span.right ? p : q).z());
        }
    }
    return span;
}

Profile profile_of(const TriangleMesh& mesh, const surface::Plane& plane, const levelset::Domain& domain) {
    Profile profile{surface::cut_by_plane(mesh, plane), surface::plane_axes(plane)[0], {}, {}};
    profile.span = span_of_profile(profile);
    for (int axis = 0; axis < 2 && !domain.axial; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        profile.middle += 0.5 * (domain.min[a] + domain.max[a]) * profile.along[axis];
    }
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (std::abs(profile.along[axis]) < 1.0 - 1e-9) continue;
        if (domain.side[a] == levelset::Side::periodic) {
            profile.shifts = {domain.min[a] - domain.max[a], domain.max[a] - domain.min[a]};
            continue;
        }
        for (const double side : {domain.min[a], domain.max[a]})
            profile.mirrors.push_back(side * profile.along[axis]);
    }
    return profile;
}

Stretches solid_at(const Profile& profile, double z) {
    std::vector<double> crossings;
    const ProfileSpan span = span_of_profile(profile);
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        if ((p.z() > z) == (q.z() > z)) return;
        const double from = p.dot(profile.along), to = q.dot(profile.along);
        const double x = from + (z - p.z()) / (q.z() - p.z()) * (to - from);
        crossings.push_back(x);
        for (const double side : profile.mirrors) crossings.push_back(2.0 * side - x);
        for (const double shift : profile.shifts) crossings.push_back(x + shift);
    });
    std::sort(crossings.begin(), crossings.end());
    // Whether material lies just inside an end: as gas is on top, if an odd number of lines begin above z.
    const auto is_solid = [&](const std::vector<double>& heights) {
        return std::ranges::count_if(heights, [&](double height) { return height > z; }) % 2 == 1;
    };
    const bool left_solid = is_solid(span.from_left), right_solid = is_solid(span.from_right);
    // What lies left of the first crossing is found at the leftmost end, copies included.
    double first = span.left;
    bool solid = left_solid;
    const auto begin_at = [&](double x, bool is_solid) {
        if (x < first) first = x, solid = is_solid;
    };
    for (const double side : profile.mirrors) begin_at(2.0 * side - span.right, right_solid);
    for (const double shift : profile.shifts) begin_at(span.left + shift, left_solid);
    return between(crossings, first < kInfinity && solid);
}

Stretches solid_below(const Profile& profile, double along) {
    std::vector<double> crossings;
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        const double from = p.dot(profile.along), to = q.dot(profile.along);
        if ((from > along) != (to > along))
            crossings.push_back(p.z() + (along - from) / (to - from) * (q.z() - p.z()));
    });
    std::sort(crossings.begin(), crossings.end());
    return between(crossings, crossings.size() % 2 == 1);  // gas is above
}

Stretches without(const Stretches& a, const Stretches& b) {
    Stretches rest;
    for (const auto& [from, to] : a) {
        double begin = from;
        for (const auto& [low, high] : b) {
            if (high <= begin || low >= to) continue;
            if (low > begin) rest.emplace_back(begin, low);
            begin = std::max(begin, high);
        }
        if (begin < to) rest.emplace_back(begin, to);
    }
    return rest;
}

Stretches openings(const Profile& profile, double z) {
    const Stretches solid = solid_at(profile, z);
    Stretches open;
    for (std::size_t k = 0; k + 1 < solid.size(); ++k) open.emplace_back(solid[k].second, solid[k + 1].first);
    return open;
}

std::pair<double, double> widest_opening(const Profile& profile, double z) {
    std::pair<double, double> widest{kNone, kNone};
    const auto off_middle = [&](const auto& of) {
        return std::abs(of.first + of.second - 2.0 * profile.middle);
    };
    for (const auto& open : openings(profile, z)) {
        const double more = open.second - open.first - (widest.second - widest.first);
        const double rounding = 1e-6 * (open.second - open.first);
        if (std::abs(more) <= rounding ? off_middle(open) < off_middle(widest) - rounding : !(more < 0.0))
            widest = open;
    }
    return widest;
}

std::pair<double, double> opening_over(const Profile& profile, double z,
                                       const std::pair<double, double>& other) {
    std::pair<double, double> most{kNone, kNone};
    double shared = 0.0;
    for (const auto& open : openings(profile, z)) {
        const double here = std::min(open.second, other.second) - std::max(open.first, other.first);
        if (!(here > shared)) continue;
        shared = here;
        most = open;
    }
    return most;
}

double opening(const Profile& profile, double z) {
    const auto [left, right] = widest_opening(profile, z);
    return right - left;
}

double Film::coverage(double thickness, double spacing) const {
    const double least = levelset::kExposed * spacing;
    const bool there = top > least && (side > least || bottom > least), walls = depth > 2.0 * spacing;
    return there && walls && !filled ? thickness / top : kNone;
}

Film film_between(const Profile& surface, const Profile& below, double spacing) {
    Film film;
    const ProfileSpan span = span_of_profile(below);
    if (!std::isfinite(span.floor)) return film;
    if (span.crest - span.floor <= kFlat * spacing) {  // flat: rounding decides which point is the lowest
        measure_flats(surface, below, span.left, 0.5 * (span.left + span.right), span.floor, spacing, film);
        return film;
    }
    const double half = 0.5 * (span.crest + span.floor);
    const std::pair<double, double> open = widest_opening(below, half);
    const double beside = middle_beside(below, open, half);
    // Within a cell of a side there may be a wall and no flat floor.
    const bool over_side = open.first < span.left + spacing || open.second > span.right - spacing;
    const Profile all_above = with_beyond(surface), all_below = with_beyond(below);
    const Floor floor =
        deepest_point(all_below, over_side && std::isfinite(beside) ? open : std::pair(span.left, span.right),
                      kFlat * spacing);
    const double along = std::isfinite(beside) ? beside : span.left,
                 crest = crossings(all_below, along).second,
                 top = measure_flats(all_above, all_below, along,
                                     middle_of_floor(below, floor, crest, spacing), floor.z, spacing, film);
    const double middle = 0.5 * (top + span.floor);
    const std::pair<double, double> halfway = widest_opening(below, middle);
    // The film's mesh may have cut the corner of floor and wall over up to two cells. So if its floor lies
    // as near to halfway down, or up to a cell higher, its side is measured above that.
    const double film_floor = deepest_point(all_above, halfway).z,
                 clear = film_floor + std::min(2.0 * spacing, 0.5 * (top - film_floor)),
                 at = film_floor < middle + spacing ? std::max(middle, clear) : middle;
    const auto bare = opening_over(below, at, halfway), left = opening_over(surface, at, bare);
    const double width = bare.second - bare.first, still_open = left.second - left.first;
    constexpr double kNearMiddle = 0.02;  // share of the depth
    // Without a film on the walls the meshes round corners differently, and `side` may come out negative.
    const double side = 0.5 * (width - still_open);
    if (!has_ledge(below, at, kNearMiddle * film.depth)) film.side = side < 0.0 ? 0.0 : side;
    film.filled = std::isfinite(width) && !std::isfinite(still_open);
    return film;
}

double seam_depth(const Profile& surface, const Profile& below, double spacing) {
    const ProfileSpan span = span_of_profile(below);
    if (!(span.crest - span.floor > kFlat * spacing)) return kNone;
    const double half = 0.5 * (span.crest + span.floor);
    const std::pair<double, double> open = widest_opening(below, half);
    const Profile above = with_beyond(surface);
    const Floor floor = deepest_point(with_beyond(below), open), notch = deepest_point(above, open);
    if (!std::isfinite(notch.z) || !std::isfinite(floor.z)) return kNone;
    // When the walls of an even film meet, the film on the floor is half the width thick. Of an opening less
    // than a cell wide, as at the tip of a bare groove, the meshes differ without a film.
    const double width = opening(below, std::min(notch.z, half));
    if (!(width > spacing && notch.z - floor.z > 0.5 * width)) return kNone;
    constexpr double kNotch = 0.1;  // least slope of both sides of a notch
    for (const double aside : {-0.25 * width, 0.25 * width})
        if (!(crossings(above, notch.along + aside).first - notch.z > kNotch * 0.25 * width)) return kNone;
    return -notch.z;
}

}  // namespace sidewall::app
