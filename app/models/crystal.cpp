#include "app/models/crystal.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/models/particles.hpp"

namespace sidewall::app {

double crystal_rate(const Vec3& normal, const CrystalAxes& axes, const CrystalRates& r) {
    const double a = std::abs(normal.dot(axes[0])), b = std::abs(normal.dot(axes[1])),
                 c = std::abs(normal.dot(axes[2])), low = std::min(a, b), high = std::max(a, b);
    const std::array<double, 3> n{std::max(high, c), std::max(low, std::min(high, c)),
                                  std::min(low, c)};  // in descending order
    if (!(n[0] > 0.0)) return 0.0;
    if (-n[0] + n[1] + 2.0 * n[2] < 0.0)
        return (r.r100 * (n[0] - n[1] - 2.0 * n[2]) + r.r110 * (n[1] - n[2]) + 3.0 * r.r311 * n[2]) / n[0];
    return (r.r111 * (0.5 * (n[1] - n[0]) + n[2]) + r.r110 * (n[1] - n[2]) + 1.5 * r.r311 * (n[0] - n[1])) /
           n[0];
}

CrystalBound crystal_bound(const CrystalAxes& axes, const CrystalRates& rates) {
    const auto hamiltonian = [&](const Vec3& p) { return p.norm() * crystal_rate(p, axes, rates); };
    constexpr int kTurns = 90;  // 2 degrees apart; kGuard covers the maximum between the samples
    constexpr double kStep = 1e-4, kGuard = 1.05;
    CrystalBound most;
    for (int i = 0; i <= kTurns; ++i)
        for (int j = 0; j < 2 * kTurns; ++j) {
            const double polar = std::numbers::pi * i / kTurns, azimuth = std::numbers::pi * j / kTurns;
            const Vec3 p(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                         std::cos(polar));
            const double here = hamiltonian(p);
            double sum = 0.0;
            for (int axis = 0; axis < 3; ++axis) {
                // One-sided differences on both sides: H may have a cusp here.
                const double ahead = std::abs(hamiltonian(p + kStep * Vec3::Unit(axis)) - here) / kStep;
                const double behind = std::abs(here - hamiltonian(p - kStep * Vec3::Unit(axis))) / kStep;
                const double slope = kGuard * std::max(ahead, behind);
                most.by_axis[axis] = std::max(most.by_axis[axis], slope);
                sum += slope;
            }
            most.sum = std::max(most.sum, sum);
        }
    return most;
}

CrystalAxes crystal_axes(const Vec3& first, const Vec3& second) {
    const Vec3 a = first.normalized(), b = (second - second.dot(a) * a).normalized();
    if (!a.allFinite() || !b.allFinite() || std::abs(b.norm() - 1.0) > 1e-6)
        return {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    return {a, b, a.cross(b)};
}

namespace {

// Defaults of epitaxy: slowest on <111>, the faces that bound selectively grown silicon and
// silicon-germanium. 1 and 0.5 are the defaults of ViennaPS 4.6 (psSelectiveEpitaxy.hpp), which has only
// <100> and <111>; the other two families grow at their mean.
constexpr double kGrowth100 = 1.0, kShare111 = 0.5;

// A crystal's material and orientation. The rates of its faces are members of Wet and Epitaxy.
struct Crystal {
    std::string material;
    std::vector<double> axis_100{1.0, 1.0, 0.0}, axis_010{-1.0, 1.0, 0.0};
};

struct Wet {
    Crystal crystal;
    CrystalRates rates;
};

struct Epitaxy {
    Crystal crystal;
    double r100 = kGrowth100;
    std::optional<double> r110, r111, r311;
    std::string deposit;
};

CrystalAxes axes_of(const Crystal& crystal) {
    const auto vector = [](const std::vector<double>& n) { return Vec3(n[0], n[1], n[2]); };
    const Vec3 first = vector(crystal.axis_100), second = vector(crystal.axis_010);
    if (!(first.norm() > 0.0)) throw KeyError("axis_100", "must not be zero");
    if (!(first.cross(second).norm() > 1e-3 * first.norm() * second.norm()))
        throw KeyError("axis_010", "must not be parallel to axis_100, or zero");
    return crystal_axes(first, second);
}

// \p rates are the keys of the four families' rates.
std::vector<Key> crystal_keys(Crystal& crystal, std::vector<Key> rates) {
    std::vector<Key> keys = {{"material", &crystal.material, "",
                              "material of the crystal; all others are inert", required(kMaterial)}};
    append_keys(keys, std::move(rates));
    keys.push_back({"axis_100", &crystal.axis_100, "",
                    "vector along a <100> axis of the crystal; the default is a (100) wafer whose x axis "
                    "is <110>",
                    sized(3)});
    keys.push_back({"axis_010", &crystal.axis_010, "",
                    "vector along a second <100> axis, not parallel to axis_100", sized(3)});
    return keys;
}

std::vector<Key> wet_keys(Wet& p) {
    const auto rate = [](const char* name, double& target, const char* faces) {
        return Key{name, &target, "length/time", std::string("etch rate of ") + faces,
                   required(kNotNegative)};
    };
    return crystal_keys(
        p.crystal, {rate("r100", p.rates.r100, "<100> faces"), rate("r110", p.rates.r110, "<110> faces"),
                    rate("r111", p.rates.r111, "<111> faces"), rate("r311", p.rates.r311, "<311> faces")});
}

std::vector<Key> epitaxy_keys(Epitaxy& p) {
    const std::string unit = "length/time", mean = "; auto: the mean of r100 and r111";
    Rule open = kNotNegative;
    open.word = "auto";
    std::vector<Key> keys = crystal_keys(
        p.crystal, {{"r100", &p.r100, unit, "growth rate of <100> faces", kNotNegative},
                    {"r110", &p.r110, unit, "growth rate of <110> faces" + mean, open},
                    {"r111", &p.r111, unit, "growth rate of <111> faces; auto: half of r100", open},
                    {"r311", &p.r311, unit, "growth rate of <311> faces" + mean, open}});
    keys.push_back(deposit_key(p.deposit));
    return keys;
}

// Unit normals of the faces of the four families.
std::vector<Vec3> crystal_planes(const CrystalAxes& axes) {
    std::vector<Vec3> planes;
    for (int h = -3; h <= 3; ++h)
        for (int k = -3; k <= 3; ++k)
            for (int l = -3; l <= 3; ++l) {
                const int squares = h * h + k * k + l * l;  // 1: 100, 2: 110, 3: 111, 11: 311
                if (squares == 1 || squares == 2 || squares == 3 || squares == 11)
                    planes.push_back((h * axes[0] + k * axes[1] + l * axes[2]).normalized());
            }
    return planes;
}

// V(n) on the \p moving materials, 0 elsewhere; \p sign is -1 for etching, 1 for growth.
Model crystal_model(const Crystal& crystal, const CrystalRates& rates, std::vector<std::uint8_t> moving,
                    double sign) {
    const CrystalAxes axes = axes_of(crystal);
    Model model;
    model.depends_on_normal = true;
    const CrystalBound bound = crystal_bound(axes, rates);
    // Lax-Friedrichs is monotone up to a Courant number of 1 with the sum of its bounds; cfl is at most 0.5.
    model.hints.max_speed = std::max(bound.sum, 0.5 * bound.by_axis.sum());
    for (const std::uint8_t moves : moving) {
        model.hints.dissipation.push_back(moves != 0 ? bound.by_axis : Vec3::Zero());
        model.hints.inert.push_back(moves == 0);
    }
    model.hints.planes = crystal_planes(axes);
    std::ranges::stable_sort(model.hints.planes, {},
                             [&](const Vec3& plane) { return crystal_rate(plane, axes, rates); });
    // Between the four families the rate is a weighted mean of theirs, so the largest bounds it.
    const double fastest = std::max({rates.r100, rates.r110, rates.r111, rates.r311});
    model.hints.max_etch_rate = [moving, rate = sign < 0.0 ? fastest : 0.0](const SurfacePoint& point) {
        return moving[static_cast<std::size_t>(point.material)] != 0 ? rate : 0.0;
    };
    model.speed = [=, moving = std::move(moving)](const SurfacePoint& point) {
        const bool moves = moving[static_cast<std::size_t>(point.material)] != 0;
        return moves ? sign * crystal_rate(point.normal, axes, rates) : 0.0;
    };
    return model;
}

Model make_wet(const Wet& p, const Materials& materials) {
    return crystal_model(p.crystal, p.rates, marked({p.crystal.material}, materials), -1.0);
}

// The film is a crystal of the same orientation as the one it grows on.
Model make_epitaxy(const Epitaxy& p, const Materials& materials) {
    const std::optional<int> deposit = film(p.deposit, materials, true);
    CrystalRates rates;
    rates.r100 = p.r100;
    rates.r111 = p.r111.value_or(kShare111 * rates.r100);
    const double mean = 0.5 * (rates.r100 + rates.r111);
    rates.r110 = p.r110.value_or(mean);
    rates.r311 = p.r311.value_or(mean);
    Model model = crystal_model(p.crystal, rates, marked({p.crystal.material, p.deposit}, materials), 1.0);
    model.deposit = deposit;
    return model;
}

}  // namespace

ModelEntry wet() {
    return model_entry(
        "wet",
        "wet etching of a crystal: V depends on the face's direction, interpolated between <100>, <110>, "
        "<111> and <311>",
        wet_keys, make_wet);
}

ModelEntry epitaxy() {
    return model_entry("epitaxy",
                       "selective epitaxy: a film grows on the crystal alone, at a rate that depends on "
                       "the face's direction",
                       epitaxy_keys, make_epitaxy);
}

}  // namespace sidewall::app
