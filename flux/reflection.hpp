#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "flux/random.hpp"
#include "flux/sampling.hpp"
#include "flux/species.hpp"

// Reflection of ions at a hit. Incidence theta in radian from the normal, energies in eV.
namespace sidewall::flux {

/// Probability that an ion is reflected: linear between two angles; 1 if the upper one is 0.
inline double reflection_probability(const Reflection& reflection, double theta) {
    if (!(reflection.to > 0.0)) return 1.0;
    if (theta < reflection.from) return 0.0;
    return theta >= reflection.to ? 1.0 : (theta - reflection.from) / (reflection.to - reflection.from);
}

/// The most probable share of its energy that a reflected ion keeps (Belen et al., JVST A 23, 99 (2005)).
inline double energy_peak(const Reflection& reflection, double theta) {
    constexpr double kRight = std::numbers::pi / 2.0;
    const double n = reflection.exponent, inflection = reflection.inflection;
    const double a = 1.0 / (1.0 + n * (kRight / inflection - 1.0));
    if (theta < inflection) return a * std::pow(theta / inflection, n);
    return 1.0 - (1.0 - a) * (kRight - theta) / (kRight - inflection);
}

/// A normally distributed number of mean 0 and variance 1 (Box and Muller 1958).
inline double sample_normal(Stream& random) {
    const double radius = std::sqrt(-2.0 * std::log(random.uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * random.uniform());
}

/// A number from normal(mean, sigma) truncated to [0, most], by rejection; uniform if most < sigma / 100.
/// \pre mean in [0, most] and, for speed, most >= sigma: then at least one trial in three is accepted.
inline double sample_truncated_normal(double mean, double sigma, double most, Stream& random) {
    if (most < 0.01 * sigma) return most * random.uniform();
    for (int trial = 0; trial < 1000; ++trial) {
        const double x = mean + sigma * sample_normal(random);
        if (x >= 0.0 && x <= most) return x;
    }
    return mean;
}

/// Mirror image of \p direction in a plane of unit \p normal.
inline Vec3 mirrored(const Vec3& direction, const Vec3& normal) {
    return direction - 2.0 * direction.dot(normal) * normal;
}

/// A random angle psi in [0, alpha] of density cos(pi/2 psi/alpha) sin(psi), by rejection from 4 x (1 - x^2)
/// for x = psi/alpha.
inline double sample_cone_angle(double alpha, Stream& random) {
    while (true) {
        const double rest = std::sqrt(random.uniform()), x = std::sqrt(1.0 - rest);  // rest = 1 - x^2
        if (random.uniform() * alpha * x * rest <= std::cos(0.5 * std::numbers::pi * x) * std::sin(alpha * x))
            return alpha * x;
    }
}

/// A unit direction of coned-cosine reflection at incidence \p theta: its angle to the specular direction has
/// the full cone's density; its azimuth is uniform over those that point off the surface.
inline Vec3 sample_coned(const Reflection& reflection, const Vec3& direction, const Vec3& normal,
                         double theta, Stream& random) {
    Vec3 axis = mirrored(direction, normal).normalized();
    const double alpha = std::numbers::pi / 2.0 - std::min(theta, reflection.cone);
    const double psi = sample_cone_angle(alpha, random);
    for (int trial = 0; trial < 1000; ++trial) {
        Vec3 out = direction_around(axis, std::cos(psi), std::sin(psi), random.uniform());
        if (out.dot(normal) > 0.0) return out;
    }
    return axis;  // only where rounding puts the axis along the surface
}

}  // namespace sidewall::flux
