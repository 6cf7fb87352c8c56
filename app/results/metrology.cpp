#include "app/results/metrology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "app/results/cut_profile.hpp"
#include "app/results/figure_values.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

// The narrowest opening within two grid spacings above the mask's bottom: the mask's own, where its lower
// edge is worn, too.
double mask_opening(const Profile& profile, double bottom, double spacing) {
    constexpr int kSamples = 16;
    double narrowest = std::numeric_limits<double>::quiet_NaN();
    for (int k = 1; k <= kSamples; ++k)
        narrowest = std::fmin(narrowest, opening(profile, bottom + 2.0 * spacing * k / kSamples));
    return narrowest;
}

double lowest(const Profile& profile) {
    double z = std::numeric_limits<double>::infinity();
    profile.each_segment([&](const Vec3& p, const Vec3& q) { z = std::min({z, p.z(), q.z()}); });
    return z;
}

// Openings at equal distances from z = 0 down to the floor, none of them at the ends.
struct Wall {
    double step = 0.0;
    std::vector<double> opening;  // number k lies (k + 1/2) step below z = 0
};

Wall wall(const Profile& profile, double depth, double spacing) {
    Wall result;
    if (!(depth > 2.0 * spacing)) return result;
    const int count = static_cast<int>(std::ceil(4.0 * depth / spacing));
    result.step = depth / count;
    for (int k = 0; k < count; ++k) result.opening.push_back(opening(profile, -(k + 0.5) * result.step));
    return result;
}

// Least squares of the half opening over z; NaNs do not count.
double sidewall_angle(const Wall& wall) {
    double n = 0.0, sz = 0.0, sw = 0.0, szz = 0.0, szw = 0.0;
    for (std::size_t k = wall.opening.size() / 4; k < 3 * wall.opening.size() / 4; ++k) {
        const double z = -(static_cast<double>(k) + 0.5) * wall.step, w = 0.5 * wall.opening[k];
        if (!std::isfinite(w)) continue;
        n += 1.0;
        sz += z;
        sw += w;
        szz += z * z;
        szw += z * w;
    }
    const double spread = n * szz - sz * sz;
    if (!(n >= 3.0 && spread > 0.0)) return kNone;
    return std::atan2(1.0, (n * szw - sz * sw) / spread) * 180.0 / std::numbers::pi;
}

// Turning points of the opening that stand out by a twentieth of a grid spacing: maxima and minima in turn.
std::array<double, 2> scallops(const Wall& wall, double spacing) {
    const double least = 0.05 * spacing;
    std::vector<std::array<double, 2>> turns;  // depth, opening
    int direction = 0;
    std::array<double, 2> extreme{0.0, 0.0};
    bool started = false;
    for (std::size_t k = 0; k < wall.opening.size(); ++k) {
        const double w = wall.opening[k], depth = (static_cast<double>(k) + 0.5) * wall.step;
        if (!std::isfinite(w)) continue;
        if (!started) extreme = {depth, w};
        started = true;
        const double change = w - extreme[1];
        if (direction * change >= 0.0 && direction != 0) {
            extreme = {depth, w};
        } else if (std::abs(change) > least) {
            if (direction != 0) turns.push_back(extreme);
            direction = change > 0.0 ? 1 : -1;
            extreme = {depth, w};
        }
    }
    if (turns.size() < 3) return {kNone, kNone};
    // Every second turn is of the same kind.
    double pitch = 0.0, swing = 0.0;
    for (std::size_t k = 0; k + 2 < turns.size(); ++k) pitch += turns[k + 2][0] - turns[k][0];
    for (std::size_t k = 0; k + 1 < turns.size(); ++k) swing += std::abs(turns[k + 1][1] - turns[k][1]);
    return {pitch / static_cast<double>(turns.size() - 2),
            0.5 * swing / static_cast<double>(turns.size() - 1)};
}

// Roughness below this part of a cell counts as flat: a thinner film counts as none elsewhere, too; faces on
// nodes lie 0.002 of their level's cells off them, which is less on all levels.
constexpr double kFlat = levelset::kExposed;

struct ProfileSpan {
    double left = kInfinity, right = -kInfinity, floor = kInfinity, crest = -kInfinity;
};

ProfileSpan span_of_profile(const Profile& profile) {
    ProfileSpan span;
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        for (const Vec3* end : {&p, &q}) {
            const double at = end->dot(profile.along);
            span.left = std::min(span.left, at);
            span.right = std::max(span.right, at);
            span.floor = std::min(span.floor, end->z());
            span.crest = std::max(span.crest, end->z());
        }
    });
    return span;
}

// z of the profile's lowest and highest crossing of the vertical at `along`.
std::pair<double, double> crossings(const Profile& profile, double along) {
    std::pair<double, double> found{kNone, kNone};
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        const double a = p.dot(profile.along), b = q.dot(profile.along);
        if (a == b || std::min(a, b) > along || std::max(a, b) < along) return;
        const double z = p.z() + (along - a) / (b - a) * (q.z() - p.z());
        found = {std::fmin(found.first, z), std::fmax(found.second, z)};
    });
    return found;
}

// The profile and what lies beyond its sides, once.
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
    return all;
}

// The middle of the material beside an opening, at a height; NaN if that does not end.
double middle_beside(const Profile& profile, const std::pair<double, double>& open, double z) {
    double left = kNone, right = kNone;
    for (const auto& [from, to] : solid_at(profile, z)) {
        if (!std::isfinite(to - from)) continue;
        if (to == open.first) left = 0.5 * (from + to);
        if (from == open.second) right = 0.5 * (from + to);
    }
    return std::isnan(right) ? left : right;
}

struct Floor {
    double z = kInfinity, along = kNone;
};

// The lowest point within an opening.
Floor deepest_point(const Profile& below, const std::pair<double, double>& within) {
    Floor lowest;
    below.each_segment([&](const Vec3& p, const Vec3& q) {
        for (const Vec3* end : {&p, &q}) {
            const double at = end->dot(below.along);
            if (at >= within.first && at <= within.second && end->z() < lowest.z) lowest = {end->z(), at};
        }
    });
    return lowest;
}

// The middle, along the profile, of what lies within a hundredth of the depth, or within `flat`, above the
// floor; of a groove its lowest point.
double middle_of_floor(const Profile& below, const Floor& floor, double top, double flat,
                       const std::pair<double, double>& within) {
    const double near = floor.z + std::max(0.01 * (top - floor.z), flat);
    double sum = 0.0, length = 0.0;
    below.each_segment([&](const Vec3& p, const Vec3& q) {
        if (std::max(p.z(), q.z()) > near) return;
        const double twice = (p + q).dot(below.along), d = (q - p).norm();
        if (0.5 * twice < within.first || 0.5 * twice > within.second) return;
        sum += 0.5 * d * twice;
        length += d;
    });
    return length > 0.0 ? sum / length : floor.along;
}

// Whether an opening begins or ends at a height, as at the ceiling of a cavity: it has no width there to
// speak of.
bool has_ledge(const Profile& profile, double z, double near) {
    const double above = opening(profile, z + near), below = opening(profile, z - near);
    return std::abs(above - below) > 0.1 * std::max(above, below);
}

// Measures the film on top and floor, of profiles that may go on beyond their sides. Returns z of the top
// below it.
double measure_flats(const Profile& surface, const Profile& below, double beside, double flat,
                     const std::pair<double, double>& within, Film& film) {
    const Floor floor = deepest_point(below, within);
    const double top = crossings(below, beside).second,
                 floor_at = middle_of_floor(below, floor, top, flat, within);
    film.top = crossings(surface, beside).second - top;
    // Both at the same place: a floor's lowest point may lie in a corner, deeper than its middle. Over the
    // floor the film's own surface is the lowest crossing above it.
    film.bottom = crossings(surface, floor_at).first - crossings(below, floor_at).first;
    film.depth = top - floor.z;
    return top;
}

}  // namespace

std::vector<Measure> measure(const Recipe& recipe, const levelset::MaterialStack& stack,
                             const TriangleMesh& mesh) {
    return measure(recipe, recipe.metrology, stack, mesh);
}

std::vector<Measure> measure(const Recipe& recipe, const MetrologySection& section,
                             const levelset::MaterialStack& stack, const TriangleMesh& mesh) {
    if (section.measures.empty()) return {};
    const std::string& length = recipe.domain.length_unit;
    const double dx = stack.domain.spacing;
    const surface::Plane plane = surface::parse_plane(section.cut);
    const Profile profile = profile_of(mesh, plane, stack.domain);
    const double floor = lowest(profile), depth = std::isfinite(floor) ? -floor : kNone;
    std::optional<Wall> found;  // hundreds of openings, for those who ask
    const auto openings = [&]() -> const Wall& {
        if (!found) found = wall(profile, depth, dx);
        return *found;
    };
    FigureReader figures(recipe, stack, mesh);
    std::vector<Measure> measures;
    for (const std::string& what : section.measures) {
        if (what == "depth") {
            measures.push_back({"depth", depth, length});
        } else if (what == "cd") {
            for (const double at : section.cd_depths)
                measures.push_back({fmt::format("cd_at_{:g}", at), opening(profile, -at), length});
        } else if (what == "sidewall_angle") {
            measures.push_back({"sidewall_angle", sidewall_angle(openings()), "degree"});
        } else if (what == "bow") {
            double widest = kNone;
            for (const double w : openings().opening) widest = std::fmax(widest, w);
            measures.push_back({"bow", widest - opening(profile, -dx), length});
        } else if (what == "undercut") {
            const double z = section.mask_bottom;
            measures.push_back(
                {"undercut", 0.5 * (opening(profile, z - dx) - mask_opening(profile, z, dx)), length});
        } else if (what == "aspect_ratio") {
            measures.push_back({"aspect_ratio", depth / opening(profile, -0.5 * depth), "1"});
        } else if (what == "scallops") {
            const auto [pitch, amplitude] = scallops(openings(), dx);
            measures.push_back({"scallop_pitch", pitch, length});
            measures.push_back({"scallop_depth", amplitude, length});
        } else if (what == "film") {
            Film t;
            if (stack.layers.size() > 1)
                t = film_between(profile,
                                 profile_of(levelset::extract_around(stack, stack.layers.size() - 2, plane),
                                            plane, stack.domain),
                                 dx);
            measures.push_back({"film_top", t.top, length});
            measures.push_back({"film_side", t.side, length});
            measures.push_back({"film_bottom", t.bottom, length});
            measures.push_back({"step_coverage_side", t.coverage(t.side, dx), "1"});
            measures.push_back({"step_coverage_bottom", t.coverage(t.bottom, dx), "1"});
        } else if (const auto figure = named_figure(what, recipe.materials)) {
            measures.push_back(figures.at(*figure));
        }
    }
    return measures;
}

std::vector<int> layer_materials(const levelset::MaterialStack& stack) {
    std::vector<int> materials;
    for (const levelset::Layer& layer : stack.layers) materials.push_back(layer.material);
    return materials;
}

std::vector<double> layer_volumes(const levelset::MaterialStack& stack) {
    std::vector<double> volumes;
    double below = 0.0;
    for (std::size_t k = 0; k < stack.layers.size(); ++k) {
        const TriangleMesh mesh = levelset::extract_surface(stack, k);
        double volume = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            volume += 0.5 * area_vector(mesh, t).z() * triangle_centroid(mesh, t).z();
        volumes.push_back(volume - below);
        below = volume;
    }
    return volumes;
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
    const double flat = kFlat * spacing;
    constexpr std::pair everywhere{-kInfinity, kInfinity};
    if (span.crest - span.floor <= flat) {  // which of its points is the lowest, rounding decides
        measure_flats(surface, below, span.left, flat, everywhere, film);
        return film;
    }
    const double half = 0.5 * (span.crest + span.floor), rounding = 1e-6 * (span.right - span.left);
    const std::pair<double, double> open = widest_opening(below, half);
    const double beside = middle_beside(below, open, half);
    const bool over_side = open.first < span.left - rounding || open.second > span.right + rounding;
    const double top = over_side && std::isfinite(beside)
                           ? measure_flats(with_beyond(surface), with_beyond(below), beside, flat, open, film)
                           : measure_flats(surface, below, span.left, flat, everywhere, film);
    const double middle = 0.5 * (top + span.floor), width = opening(below, middle),
                 still_open = opening(surface, middle);
    constexpr double kNearMiddle = 0.02;  // of the depth
    if (!has_ledge(below, middle, kNearMiddle * film.depth)) film.side = 0.5 * (width - still_open);
    film.filled = std::isfinite(width) && !std::isfinite(still_open);
    return film;
}

}  // namespace sidewall::app
