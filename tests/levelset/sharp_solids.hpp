#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "surface/vec3.hpp"

// Solids with sharp edges by their exact signed distance, in cells.
namespace sidewall::test {

using Distance = std::function<double(const Vec3&)>;
using Line = std::vector<std::array<double, 2>>;

/// The solid below a line in x and z with straight ends, turned about y by \p turn radians.
inline Distance below_line(Line line, double turn = 0.0) {
    return [line, turn](const Vec3& point) {
        const double x = std::cos(turn) * point.x() + std::sin(turn) * point.z(),
                     z = std::cos(turn) * point.z() - std::sin(turn) * point.x();
        double nearest = 1e9;
        int above = 0;  // pieces of the line above the point
        for (std::size_t k = 0; k + 1 < line.size(); ++k) {
            const bool first = k == 0, last = k + 2 == line.size();
            const double dx = line[k + 1][0] - line[k][0], dz = line[k + 1][1] - line[k][1];
            double t = ((x - line[k][0]) * dx + (z - line[k][1]) * dz) / (dx * dx + dz * dz);
            if (!first) t = std::max(t, 0.0);
            if (!last) t = std::min(t, 1.0);
            nearest = std::min(nearest, std::hypot(x - line[k][0] - t * dx, z - line[k][1] - t * dz));
            const double s = dx != 0.0 ? (x - line[k][0]) / dx : -1.0;
            if (dx != 0.0 && (first || s >= 0.0) && (last || s < 1.0) && line[k][1] + s * dz > z) ++above;
        }
        return above % 2 == 1 ? -nearest : nearest;
    };
}

inline double box_distance(const Vec3& p, const Vec3& half) {
    const Vec3 q = p.cwiseAbs() - half;
    return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0);
}
inline double cylinder_distance(const Vec3& p, double radius, double half_height) {
    const double a = std::hypot(p.x(), p.y()) - radius, b = std::abs(p.z()) - half_height;
    return std::hypot(std::max(a, 0.0), std::max(b, 0.0)) + std::min(std::max(a, b), 0.0);
}

inline Eigen::Matrix3d turned(double about_z, double about_x) {
    return (Eigen::AngleAxisd(about_z, Vec3::UnitZ()) * Eigen::AngleAxisd(about_x, Vec3::UnitX()))
        .toRotationMatrix();
}

/// A floor at z = 0 with a rectangular post of half widths 6 and 7 on it (\p height > 0) or such a pit in it.
inline Distance on_floor(const Vec3& at, double height) {
    return [=](const Vec3& point) {
        const Vec3 p = point - at, half(6.0, 7.0, 0.0);
        const double low = std::min(0.0, height), high = std::max(0.0, height);
        const auto beyond = [](double x, double from, double to) {
            return std::max({0.0, from - x, x - to});
        };
        const double in_x = half.x() - std::abs(p.x()), in_y = half.y() - std::abs(p.y());
        const bool over = in_x > 0.0 && in_y > 0.0;
        double d = std::hypot(p.z(), over ? std::min(in_x, in_y) : 0.0);  // distance to the floor around
        const double out_x = std::max(0.0, -in_x), out_y = std::max(0.0, -in_y),
                     out_z = beyond(p.z(), low, high);
        d = std::min(d, Vec3(out_x, out_y, p.z() - height).norm());
        d = std::min(d, Vec3(in_x, out_y, out_z).norm());
        d = std::min(d, Vec3(out_x, in_y, out_z).norm());
        const bool solid =
            height > 0.0 ? p.z() < 0.0 || (over && p.z() < height) : p.z() < 0.0 && !(over && p.z() > height);
        return solid ? -d : d;
    };
}

/// Two to five boxes and cylinders, turned or not, on nodes or not, added or cut out, on a wafer or not.
inline Distance random_solid(std::mt19937& random) {
    struct Body {
        Eigen::Matrix3d turn;
        Vec3 at, half;
        bool is_box, is_cut;
    };
    std::uniform_real_distribution<double> u(-1.0, 1.0);
    std::vector<Body> bodies(2 + random() % 4);
    for (Body& b : bodies) {
        const auto turn = random() % 3;
        const double about_z = turn > 0 ? 3.0 * u(random) : 0.0, about_x = turn > 1 ? 3.0 * u(random) : 0.0;
        b.turn = turned(about_z, about_x);
        for (int k = 0; k < 3; ++k) b.at[k] = (k < 2 ? 10.0 : 6.0) * u(random);
        for (int k = 0; k < 3; ++k) b.half[k] = 4.0 + 3.0 * u(random);
        if (random() % 2 == 0) b.at = b.at.array().round();
        if (random() % 2 == 0) b.half = b.half.array().round();
        if (random() % 4 == 0) b.half.x() = 0.9 + 0.6 * u(random);  // plates
        b.is_box = random() % 2 == 0;
        b.is_cut = &b != &bodies.front() && random() % 2 == 0;
    }
    const bool wafer = random() % 2 == 0;
    return [bodies, wafer](const Vec3& p) {
        double d = wafer ? p.z() : 1e3;
        for (const Body& b : bodies) {
            const Vec3 q = b.turn * (p - b.at);
            const double own =
                b.is_box ? box_distance(q, b.half) : cylinder_distance(q, b.half.x(), b.half.z());
            d = b.is_cut ? std::max(d, -own) : std::min(d, own);
        }
        return d;
    };
}

}  // namespace sidewall::test
