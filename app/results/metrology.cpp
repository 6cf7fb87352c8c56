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
#include "app/results/film.hpp"
#include "levelset/meshes/extract.hpp"

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

}  // namespace sidewall::app
