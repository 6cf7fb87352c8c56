#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>

#include "flux/species.hpp"
#include "surface/basis.hpp"
#include "surface/vec3.hpp"

namespace sidewall::flux {

/// The direction at polar angle (cosine, sine) from \p axis and azimuth 2 pi \p u.
inline Vec3 direction_around(const Vec3& axis, double cosine, double sine, double u) {
    const auto [s, t] = basis_around(axis);
    const double phi = 2.0 * std::numbers::pi * u;
    return sine * std::cos(phi) * s + sine * std::sin(phi) * t + cosine * axis;
}

/// A direction within the hemisphere of the unit vector \p axis, density per solid angle
/// (exponent + 1) / (2 pi) cos^exponent. \p u1, \p u2 uniform in (0, 1); exponent >= 0.
inline Vec3 sample_cosine_power(const Vec3& axis, double exponent, double u1, double u2) {
    // cos = u1^(1/(n+1)). For a collimated beam 1 - cos^2 would cancel; expm1 does not.
    const double log_cosine = std::log(u1) / (exponent + 1.0);
    return direction_around(axis, std::exp(log_cosine), std::sqrt(-std::expm1(2.0 * log_cosine)), u2);
}

/// A direction within the hemisphere of \p axis, density per solid angle cos (1 + b cos^2) / (pi (1 + b / 2))
/// with b >= -1, by inversion in cos^2. \p u1, \p u2 uniform in (0, 1).
inline Vec3 sample_cosine_beta(const Vec3& axis, double b, double u1, double u2) {
    const double whole = u1 * (2.0 + b);
    const double squared = std::min(1.0, whole / (1.0 + std::sqrt(std::max(0.0, 1.0 + b * whole))));
    return direction_around(axis, std::sqrt(squared), std::sqrt(1.0 - squared), u2);
}

/// A direction of diffuse re-emission (Lambert): density cos / pi about the unit vector \p normal.
inline Vec3 sample_lambertian(const Vec3& normal, double u1, double u2) {
    return direction_around(normal, std::sqrt(u1), std::sqrt(1.0 - u1), u2);
}

/// 24 random bits as a number in (0, 1).
inline float unit_float(std::uint32_t word) {
    return (static_cast<float>(static_cast<std::int32_t>(word >> 8)) + 0.5f) * 0x1p-24f;
}

/// Sine and cosine of 2 pi \p u, u in [0, 1]: Taylor series of the half angle, which lies in [-pi/2, pi/2];
/// exact to 2e-7.
inline void sine_cosine(float u, float& sine, float& cosine) {
    const float x = (u - 0.5f) * 3.14159265358979f, y = x * x;
    const float s =
        x *
        (1.0f + y * (-1.6666667e-1f +
                     y * (8.3333333e-3f + y * (-1.9841270e-4f + y * (2.7557319e-6f - y * 2.5052108e-8f)))));
    const float c =
        1.0f + y * (-0.5f + y * (4.1666667e-2f +
                                 y * (-1.3888889e-3f +
                                      y * (2.4801587e-5f + y * (-2.7557319e-7f + y * 2.0876757e-9f)))));
    // sin(2 pi u) = -sin(2 x), cos(2 pi u) = -cos(2 x).
    sine = -2.0f * s * c;
    cosine = s * s - c * c;
}

/// sample_lambertian about the unit vector (nx, ny, nz), in single precision and in a form that vectorises.
inline void lambert(float nx, float ny, float nz, float u1, float u2, float& dx, float& dy, float& dz) {
    float sine = 0.0f, cosine = 0.0f;
    sine_cosine(u2, sine, cosine);
    const float up = std::sqrt(u1), out = std::sqrt(1.0f - u1);
    const float s = out * cosine, t = out * sine;
    const auto [sx, sy, sz, tx, ty, tz] = tangents_of(nx, ny, nz, nz < 0.0f ? -1.0f : 1.0f);
    dx = s * sx + t * tx + up * nx;
    dy = s * sy + t * ty + up * ny;
    dz = up * nz + s * sz + t * tz;
}

/// A direction about \p axis and an energy (eV) from a tabulated source: a bin is chosen by its share, then
/// angle and energy uniformly within it. \p u1, \p u2, \p u3 uniform in (0, 1).
inline std::pair<Vec3, double> sample_bins(std::span<const SourceBin> bins, const Vec3& axis, double u1,
                                           double u2, double u3) {
    const auto bin = std::upper_bound(bins.begin(), bins.end() - 1, u1,
                                      [](double u, const SourceBin& b) { return u < b.until; });
    const double before = bin == bins.begin() ? 0.0 : (bin - 1)->until;
    const double part = std::clamp((u1 - before) / (bin->until - before), 0.0, 1.0);
    const double angle = bin->angle_from + part * (bin->angle_to - bin->angle_from);
    return {direction_around(axis, std::cos(angle), std::sin(angle), u2),
            bin->energy_from + u3 * (bin->energy_to - bin->energy_from)};
}

/// The even bits of \p word, packed into its lower half.
inline std::uint32_t even_bits(std::uint32_t word) {
    word &= 0x55555555u;
    word = (word | word >> 1) & 0x33333333u;
    word = (word | word >> 2) & 0x0f0f0f0fu;
    word = (word | word >> 4) & 0x00ff00ffu;
    return (word | word >> 8) & 0x0000ffffu;
}

/// The cell (x, y), 16 bits each, at \p index on a Hilbert curve through the 2^16 x 2^16 square. All levels
/// at once, by parallel prefixes of complement and swap (Warren, Hacker's Delight, section 16-2).
inline std::pair<std::uint32_t, std::uint32_t> hilbert_cell(std::uint32_t index) {
    constexpr std::uint32_t kEven = 0x55555555u;
    const std::uint32_t odd = (index >> 1) & kEven;
    std::uint32_t turn = ((index & kEven) + odd) ^ kEven;
    turn ^= turn >> 2;  // unrolled, so that loops over cells vectorise
    turn ^= turn >> 4;
    turn ^= turn >> 8;
    turn ^= turn >> 16;
    const std::uint32_t swap = turn & kEven, complement = (turn >> 1) & kEven;
    const std::uint32_t flip = (index & swap) ^ complement;
    const std::uint32_t cell = index ^ odd ^ flip ^ (flip << 1);
    return {even_bits(cell >> 1), even_bits(cell)};
}

/// The bits of \p word in reverse order.
inline std::uint32_t reversed_bits(std::uint32_t word) {
    word = (word >> 1 & 0x55555555u) | (word & 0x55555555u) << 1;
    word = (word >> 2 & 0x33333333u) | (word & 0x33333333u) << 2;
    word = (word >> 4 & 0x0f0f0f0fu) | (word & 0x0f0f0f0fu) << 4;
    word = (word >> 8 & 0x00ff00ffu) | (word & 0x00ff00ffu) << 8;
    return word >> 16 | word << 16;
}

/// Second coordinate of Sobol's sequence, as 32 bits of fraction, from the Pascal matrix modulo 2. The first
/// is reversed_bits(index). Any aligned run of 2^k indices puts one point into each of 2^k equal boxes.
inline std::uint32_t sobol_second(std::uint32_t index) {
    // The product of the index with an upper-triangular Pascal matrix, in log2(32) operations on whole words.
    std::uint32_t v = index;
    v ^= (v >> 16) & 0x0000ffffu;
    v ^= (v >> 8) & 0x00ff00ffu;
    v ^= (v >> 4) & 0x0f0f0f0fu;
    v ^= (v >> 2) & 0x33333333u;
    v ^= (v >> 1) & 0x55555555u;
    return reversed_bits(v);
}

/// Owen's nested uniform scrambling of 32 bits of fraction by a hash (Laine and Karras, EGSR 2011, with the
/// constants of Vegdahl (2021)). \p shift, \p factor: random words; over random shifts the value is uniform.
inline std::uint32_t owen_scrambled(std::uint32_t fraction, std::uint32_t shift, std::uint32_t factor) {
    std::uint32_t x = reversed_bits(fraction);
    x ^= x * 0x3d20adeau;
    x += shift;
    x *= factor | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    return reversed_bits(x);
}

}  // namespace sidewall::flux
