#include "tests/flux/truth.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace sidewall::flux {

double clausing_transmission(double length, int cells, double sticking) {
    // Share of a ring's emission that passes the disk at distance d. Minus its derivative is the share per
    // length that meets the wall there.
    const auto to_disk = [](double d) {
        const double h = 0.5 * d;
        return (h * h + 0.5) / std::sqrt(h * h + 1.0) - h;
    };
    const double ring = length / cells;  // its width
    Eigen::MatrixXd system = Eigen::MatrixXd::Identity(cells, cells);
    Eigen::VectorXd exit(cells);
    for (int i = 0; i < cells; ++i) {
        const double x = (i + 0.5) * ring;
        exit[i] = to_disk(length - x);
        for (int j = 0; j < cells; ++j) {
            const double near = std::abs(i - j) - 0.5, far = std::abs(i - j) + 0.5;
            // The ring's own cell reaches half a cell either way.
            system(i, j) -= (1.0 - sticking) * (i == j ? 2.0 * (0.5 - to_disk(0.5 * ring))
                                                       : to_disk(near * ring) - to_disk(far * ring));
        }
    }
    const Eigen::VectorXd escape = system.partialPivLu().solve(exit);
    const double x = 2.0 + length * length;
    double transmitted = 0.5 * (x - std::sqrt(x * x - 4.0));  // disk to disk
    for (int i = 0; i < cells; ++i)
        transmitted += 2.0 * ring * to_disk((i + 0.5) * ring) * (1.0 - sticking) * escape[i];
    return transmitted;
}

double clausing_transmission(double length, double sticking) {
    return (4.0 * clausing_transmission(length, 400, sticking) -
            clausing_transmission(length, 200, sticking)) /
           3.0;
}

double disk_view(double depth, double offset) {
    const double a = offset * offset, h = depth * depth, z = 1.0 + a + h;
    return 0.5 * (1.0 - (a + h - 1.0) / std::sqrt(z * z - 4.0 * a));
}

double at_position(const std::vector<double>& strips, double position) {
    const double last = static_cast<double>(strips.size() - 1);
    const double x = std::clamp(position * static_cast<double>(strips.size()) - 0.5, 0.0, last);
    const auto i = std::min(static_cast<std::size_t>(x), strips.size() - 2);
    const double part = position * static_cast<double>(strips.size()) - 0.5 - static_cast<double>(i);
    return (1.0 - part) * strips[i] + part * strips[i + 1];
}

TrenchFlux trench_flux(double depth, double sticking, int wall_strips, int floor_strips, Emitter emitter) {
    struct Strip {
        double x0, z0, x1, z1;
        double length() const { return std::hypot(x1 - x0, z1 - z0); }
    };
    std::vector<Strip> strips;
    for (int i = 0; i < wall_strips; ++i)
        strips.push_back({0.0, -depth * i / wall_strips, 0.0, -depth * (i + 1) / wall_strips});
    for (int i = 0; i < floor_strips; ++i)
        strips.push_back({1.0 * i / floor_strips, -depth, 1.0 * (i + 1) / floor_strips, -depth});
    for (int i = 0; i < wall_strips; ++i)
        strips.push_back({1.0, -depth * (wall_strips - i) / wall_strips, 1.0,
                          -depth * (wall_strips - i - 1) / wall_strips});
    // Crossed strings: strips run along the profile, so that a's end faces b's start.
    const auto exchange = [](const Strip& a, const Strip& b) {
        const auto apart = [](double x0, double z0, double x1, double z1) {
            return std::hypot(x1 - x0, z1 - z0);
        };
        return 0.5 * (apart(a.x0, a.z0, b.x0, b.z0) + apart(a.x1, a.z1, b.x1, b.z1) -
                      apart(a.x1, a.z1, b.x0, b.z0) - apart(a.x0, a.z0, b.x1, b.z1));
    };
    const auto n = static_cast<int>(strips.size());
    const Strip opening{1.0, 0.0, 0.0, 0.0};
    Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd direct(n);
    for (int i = 0; i < n; ++i) {
        const auto a = static_cast<std::size_t>(i);
        direct[i] = emitter == Emitter::opening ? exchange(strips[a], opening) / strips[a].length() : 0.0;
        for (int j = 0; j < n; ++j) {
            if (i == j) continue;
            const auto b = static_cast<std::size_t>(j);
            const double view = exchange(strips[std::min(a, b)], strips[std::max(a, b)]) / strips[a].length();
            system(i, j) -= (1.0 - sticking) * view;
            if (emitter == Emitter::floor && j >= wall_strips && j < wall_strips + floor_strips)
                direct[i] += view;
        }
    }
    const Eigen::VectorXd flux = system.partialPivLu().solve(direct);
    TrenchFlux result;
    for (int i = 0; i < wall_strips; ++i) result.wall.push_back(flux[i]);
    for (int i = 0; i < floor_strips; ++i) result.floor.push_back(flux[wall_strips + i]);
    for (const double value : result.wall) result.wall_mean += value / wall_strips;
    for (const double value : result.floor) result.floor_mean += value / floor_strips;
    return result;
}

CylinderFlux cylinder_flux(double depth, double sticking, int rings, int annuli) {
    // Area times view factor between coaxial disks of radius 1 and r, a distance h apart.
    const auto disks = [](double r, double h) {
        const double x = 1.0 + r * r + h * h;
        return std::numbers::pi * 2.0 * r * r / (x + std::sqrt(x * x - 4.0 * r * r));
    };
    // Exchange areas: between rings, by how many lie between them, and of each annulus with every ring.
    const int n = rings + annuli;
    const double step = depth / rings;
    const auto radius = [&](int k) { return static_cast<double>(k) / annuli; };
    Eigen::VectorXd area(n), right(n), between(rings);
    Eigen::MatrixXd below(rings, annuli);
    between[0] = 2.0 * (std::numbers::pi * step - disks(1.0, 0.0) + disks(1.0, step));
    for (int i = 0; i < rings; ++i) {
        area[i] = 2.0 * std::numbers::pi * step;
        right[i] = disks(1.0, i * step) - disks(1.0, (i + 1) * step);
        if (i > 0)
            between[i] = disks(1.0, (i - 1) * step) - 2.0 * disks(1.0, i * step) + disks(1.0, (i + 1) * step);
    }
    for (int k = 0; k < annuli; ++k) {
        const auto seen = [&](double h) { return disks(radius(k + 1), h) - disks(radius(k), h); };
        area[rings + k] = std::numbers::pi * (std::pow(radius(k + 1), 2.0) - std::pow(radius(k), 2.0));
        right[rings + k] = seen(depth);
        for (int i = 0; i < rings; ++i) below(i, k) = seen(depth - (i + 1) * step) - seen(depth - i * step);
    }
    const Eigen::VectorXd reversed = between.reverse();
    // Conjugate gradients: the balance is symmetric, and a dense factor of thousands of rings takes minutes.
    Eigen::VectorXd flux = Eigen::VectorXd::Zero(n), rest = right, exchanged(n);
    Eigen::VectorXd way = rest.cwiseQuotient(area);
    double square = rest.dot(way);
    const double enough = 1e-26 * square;
    for (int turn = 0; turn < 10 * n && square > enough; ++turn) {
        for (int i = 0; i < rings; ++i)
            exchanged[i] = reversed.tail(i + 1).dot(way.head(i + 1)) +
                           between.segment(1, rings - 1 - i).dot(way.segment(i + 1, rings - 1 - i)) +
                           below.row(i).dot(way.tail(annuli));
        exchanged.tail(annuli) = below.transpose() * way.head(rings);
        const Eigen::VectorXd balance = area.cwiseProduct(way) - (1.0 - sticking) * exchanged;
        const double length = square / way.dot(balance);
        flux += length * way;
        rest -= length * balance;
        const double next = rest.dot(rest.cwiseQuotient(area));
        way = rest.cwiseQuotient(area) + next / square * way;
        square = next;
    }
    CylinderFlux result;
    result.wall.assign(flux.data(), flux.data() + rings);
    result.floor_mean = flux.tail(annuli).dot(area.tail(annuli)) / std::numbers::pi;
    return result;
}

double integral(double from, double to, const std::function<double(double)>& f, int intervals) {
    const double h = (to - from) / intervals;
    double sum = f(from) + f(to);
    for (int i = 1; i < intervals; ++i) sum += (i % 2 == 1 ? 4.0 : 2.0) * f(from + i * h);
    return sum * h / 3.0;
}

}  // namespace sidewall::flux
