#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "surface/basis.hpp"

// sample_lambertian in single precision, in the form of loops that compilers vectorise.
namespace sidewall::flux {

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

/// Lambert's law about the unit vector (nx, ny, nz).
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

}  // namespace sidewall::flux
