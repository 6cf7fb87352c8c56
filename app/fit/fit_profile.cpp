#include "app/fit/fit_profile.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "app/common/text.hpp"
#include "app/recipe/profile_csv.hpp"
#include "app/results/result.hpp"
#include "surface/cut.hpp"

namespace sidewall::app {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMostProfilePoints = 5000;

// Signed distance from the nearest segment of a contour, and the direction in which it grows.
struct Nearest {
    double distance = kInfinity;
    Vector2d normal = Vector2d::Zero();
};

Nearest nearest_on(const Contour& contour, const Vector2d& p) {
    Nearest nearest;
    double best = kInfinity, steepest = 0.0;
    for (const auto& [a, b] : contour) {
        const Vector2d along = b - a, to = p - a;
        const double length2 = along.squaredNorm();
        const double t = length2 > 0.0 ? std::clamp(to.dot(along) / length2, 0.0, 1.0) : 0.0;
        const Vector2d from = to - t * along;
        const double distance = from.norm();
        if (distance > best * (1.0 + 1e-12) + 1e-300) continue;
        // At a corner two segments are equally near: that whose line is farther away tells the side.
        const double across =
            (along.x() * to.y() - along.y() * to.x()) / std::sqrt(std::max(length2, 1e-300));
        if (distance >= best * (1.0 - 1e-12) && std::abs(across) <= steepest) continue;
        best = std::min(best, distance);
        steepest = std::abs(across);
        const double side = across < 0.0 ? -1.0 : 1.0;
        const Vector2d left = Vector2d(-along.y(), along.x()) / std::sqrt(std::max(length2, 1e-300));
        nearest = {side * distance,
                   distance > 1e-9 * std::sqrt(length2) ? Vector2d(side * from / distance) : left};
    }
    return nearest;
}

double sum_of_squares(const Contour& contour, const std::vector<Vector2d>& points, const Vector2d& offset) {
    double sum = 0.0;
    for (const Vector2d& p : points) sum += std::pow(nearest_on(contour, p + offset).distance, 2);
    return sum;
}

// Improves an offset by Gauss-Newton steps, which are halved until the sum of squares falls.
void settle_offset(const Contour& contour, const std::vector<Vector2d>& points, ProfileOffset free,
                   Vector2d& offset) {
    constexpr int kMostSteps = 30;
    double sum = sum_of_squares(contour, points, offset);
    for (int step = 0; step < kMostSteps; ++step) {
        Eigen::Matrix2d h = Eigen::Matrix2d::Zero();
        Vector2d g = Vector2d::Zero();
        for (const Vector2d& p : points) {
            Nearest near = nearest_on(contour, p + offset);
            if (!free.x) near.normal.x() = 0.0;
            if (!free.z) near.normal.y() = 0.0;
            h += near.normal * near.normal.transpose();
            g += near.distance * near.normal;
        }
        h.diagonal().array() += 1e-9 * h.trace() + 1e-300;
        Vector2d change = -h.ldlt().solve(g);
        double now = sum_of_squares(contour, points, offset + change);
        for (int half = 0; half < 6 && now >= sum; ++half) {
            change *= 0.5;
            now = sum_of_squares(contour, points, offset + change);
        }
        if (now >= sum) return;
        offset += change;
        if (now > sum * (1.0 - 1e-9)) return;
        sum = now;
    }
}

Vector2d find_offset(const Contour& contour, const std::vector<Vector2d>& points, ProfileOffset free) {
    constexpr std::size_t kFew = 60;
    constexpr double kReach = 0.2;  // starts beside 0, as a share of the profile's extent
    std::vector<Vector2d> few;
    for (std::size_t i = 0; i < points.size(); ++i)
        if (i * kFew / points.size() != (i + 1) * kFew / points.size() || points.size() <= kFew)
            few.push_back(points[i]);
    const double reach = kReach * bounds_of(points).sizes().maxCoeff();
    Vector2d best = Vector2d::Zero();
    double least = kInfinity;
    for (const int i : {0, -1, 1})
        for (const int j : {0, -1, 1}) {
            if ((i != 0 && !free.x) || (j != 0 && !free.z)) continue;
            Vector2d offset(i * reach, j * reach);
            settle_offset(contour, few, free, offset);
            if (const double sum = sum_of_squares(contour, few, offset); sum < 0.999 * least) {
                least = sum;
                best = offset;
            }
        }
    settle_offset(contour, points, free, best);
    return best;
}

// Adds the mirrored or periodic copies beyond the domain's sides.
void add_beyond(const levelset::Domain& domain, const Vec3& along, Contour& contour) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const double direction = along[static_cast<int>(axis)];
        if (std::abs(direction) < 1.0 - 1e-9) continue;
        const double low = std::min(domain.min[axis] * direction, domain.max[axis] * direction);
        const double high = std::max(domain.min[axis] * direction, domain.max[axis] * direction);
        const Contour inside = contour;
        for (const double side : {low, high})
            for (std::array<Vector2d, 2> piece : inside) {
                for (Vector2d& p : piece)
                    p.x() = domain.side[axis] == levelset::Side::reflective ? 2.0 * side - p.x()
                            : side == low                                   ? p.x() - (high - low)
                                                                            : p.x() + (high - low);
                if (domain.side[axis] == levelset::Side::reflective) std::swap(piece[0], piece[1]);
                contour.push_back(piece);
            }
    }
}

}  // namespace

MeasuredProfile read_measured_profile(const std::string& name, const std::string& length_unit) {
    MeasuredProfile profile{.name = name};
    std::string file = name;
    if (const auto at = name.rfind('@'); at != std::string::npos && !std::filesystem::exists(name)) {
        file = name.substr(0, at);
        profile.time = finite_number(name.substr(at + 1));
        if (!profile.time || *profile.time < 0.0)
            throw RecipeError("--target-profile {}: after @ stands a process time, e.g. {}@2.5", name, file);
    }
    const ProfileTable table = read_points(file, length_unit, kMostProfilePoints);
    profile.understood = table.understood;
    for (const auto& [x, z] : table.points) profile.points.emplace_back(x, z);
    if (profile.points.size() < 3)
        throw FileError("{}: has {} points: a profile has 3 to {} rows x,z", file, profile.points.size(),
                        kMostProfilePoints);
    return profile;
}

Eigen::AlignedBox2d bounds_of(const std::vector<Vector2d>& points) {
    Eigen::AlignedBox2d box;
    for (const Vector2d& p : points) box.extend(p);
    return box;
}

void require_saved_time(const MeasuredProfile& profile, const Recipe& recipe) {
    if (!profile.time) return;
    const double asked = *profile.time;
    const std::vector<Step> steps = expanded_steps(recipe);
    const double total = total_duration(steps), slack = 1e-6 * total;
    std::vector<double> times{0.0, total};
    double end = 0.0;
    for (const Step& step : steps) {
        if (has_stop(step)) return;  // its end is unknown before the run
        times.push_back(end += step.duration);
    }
    const double every = recipe.output.every.value_or(0.0);
    if (every > 0.0) times = {0.0, every * std::round(asked / every), total};
    const auto is_it = [&](double time) { return std::abs(time - asked) <= slack && time <= total + slack; };
    if (std::none_of(times.begin(), times.end(), is_it))
        throw RecipeError(
            "--target-profile {}: runs save no surface at time {:g}, of {:g} {}: set [output] every so that they do, e.g. "
            "--set output.every={:g}",
            profile.name, asked, total, recipe.domain.time_unit, asked);
}

void require_wafer_size(const MeasuredProfile& profile, const Recipe& recipe) {
    const Vector2d span = bounds_of(profile.points).sizes();
    const std::size_t along = surface::parse_plane(recipe.metrology.cut).normal.x() != 0.0 ? 1 : 0;
    const double wafer = recipe.domain.extent[along];
    constexpr double kWithBeyond = 3.0;  // in widths: contour_of() adds two copies
    if (span.x() <= kWithBeyond * wafer && span.maxCoeff() >= recipe.domain.grid_spacing) return;
    throw FileError(
        "{0}: its points span {1:.4g} by {2:.4g}, the wafer is {3:.4g} {4} wide: are "
        "they in another unit? Give them in {4}, the recipe's length_unit",
        profile.name, span.x(), span.y(), wafer, recipe.domain.length_unit);
}

Contour contour_of(const std::filesystem::path& folder, const Recipe& recipe, std::optional<double> time) {
    const std::vector<SavedSurface> saved = saved_surfaces(folder);
    const SavedSurface* chosen = &saved.back();
    if (time) {
        constexpr double kSlack = 1e-6;                             // relative
        if (*time > saved.back().time * (1.0 + kSlack)) return {};  // the run ended before
        chosen = &saved_at(saved, *time);
    }
    const surface::Plane plane = surface::parse_plane(recipe.metrology.cut);
    const auto axes = surface::plane_axes(plane);
    Contour contour;
    const auto flat = [&](const Vec3& p) { return Vector2d(p.dot(axes[0]), p.dot(axes[1])); };
    for (const surface::Polyline& line : surface::cut_by_plane(surface::read_mesh(chosen->file), plane)) {
        const std::size_t count = line.points.size();
        for (std::size_t i = 0; i + (line.closed ? 0 : 1) < count; ++i)
            contour.push_back({flat(line.points[i]), flat(line.points[(i + 1) % count])});
    }
    add_beyond(domain_of(recipe), axes[0], contour);
    return contour;
}

std::optional<ProfileDistance> distance_to(const Contour& contour, const std::vector<Vector2d>& points,
                                           ProfileOffset free) {
    if (contour.empty() || points.empty()) return std::nullopt;
    ProfileDistance result;
    if (free.x || free.z) result.offset = find_offset(contour, points, free);
    result.signed_distances.resize(static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
        result.signed_distances[static_cast<Eigen::Index>(i)] =
            nearest_on(contour, points[i] + result.offset).distance;
    return result;
}

}  // namespace sidewall::app
