#include "app/results/cut_profile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidewall::app {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Gas and material alternate between crossings.
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

}  // namespace

Profile profile_of(const TriangleMesh& mesh, const surface::Plane& plane, const levelset::Domain& domain) {
    Profile profile{surface::cut_by_plane(mesh, plane), surface::plane_axes(plane)[0], {}, {}};
    for (int axis = 0; axis < 2; ++axis) {
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
    double left = kInfinity, left_z = 0.0;
    const auto visit = [&](double from, double from_z, double to, double to_z) {
        for (const auto& [x, height] : {std::pair(from, from_z), {to, to_z}})
            if (x < left) {
                left = x;
                left_z = height;
            }
        if ((from_z > z) != (to_z > z))
            crossings.push_back(from + (z - from_z) / (to_z - from_z) * (to - from));
    };
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        const double from = p.dot(profile.along), to = q.dot(profile.along);
        visit(from, p.z(), to, q.z());
        for (const double side : profile.mirrors) visit(2.0 * side - from, p.z(), 2.0 * side - to, q.z());
        for (const double shift : profile.shifts) visit(from + shift, p.z(), to + shift, q.z());
    });
    std::sort(crossings.begin(), crossings.end());
    // Left of the first crossing lies material if the surface begins above z, else gas.
    return between(crossings, left < kInfinity && left_z > z);
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
        const double alike = 1e-6 * (open.second - open.first);  // but for rounding
        if (std::abs(more) <= alike ? off_middle(open) < off_middle(widest) - alike : !(more < 0.0))
            widest = open;
    }
    return widest;
}

double opening(const Profile& profile, double z) {
    const auto [left, right] = widest_opening(profile, z);
    return right - left;
}

}  // namespace sidewall::app
