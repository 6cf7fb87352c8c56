#include "app/results/cut_profile.hpp"

#include <algorithm>
#include <cmath>

#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

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
    double left = kInfinity, left_z = 0.0, right = -kInfinity, right_z = 0.0;
    const auto reach = [&](double x, double height) {
        if (x < left) left = x, left_z = height;
        if (x > right) right = x, right_z = height;
    };
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        const double from = p.dot(profile.along), to = q.dot(profile.along);
        reach(from, p.z());
        reach(to, q.z());
        if ((p.z() > z) == (q.z() > z)) return;
        const double x = from + (z - p.z()) / (q.z() - p.z()) * (to - from);
        crossings.push_back(x);
        for (const double side : profile.mirrors) crossings.push_back(2.0 * side - x);
        for (const double shift : profile.shifts) crossings.push_back(x + shift);
    });
    std::sort(crossings.begin(), crossings.end());
    // Left of the first crossing lies material if the surface begins above z, else gas.
    double first = left, first_z = left_z;
    const auto begin_at = [&](double x, double height) {
        if (x < first) first = x, first_z = height;
    };
    for (const double side : profile.mirrors) begin_at(2.0 * side - right, right_z);
    for (const double shift : profile.shifts) begin_at(left + shift, left_z);
    return between(crossings, first < kInfinity && first_z > z);
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

double opening(const Profile& profile, double z) {
    const auto [left, right] = widest_opening(profile, z);
    return right - left;
}

}  // namespace sidewall::app
