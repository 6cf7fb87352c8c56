#pragma once
#include <algorithm>
#include <array>
#include <cstddef>

#include "levelset/row.hpp"

// One-sided differences of eight neighbouring nodes at once: plain loops that compilers vectorise.
namespace sidewall::levelset {

/// Differences (not yet divided by dx) towards the lower and the higher neighbour along one axis.
struct OneSided {
    Row minus, plus;
};

// Guards the weights against 0/0; differences are of order 1, as phi is scaled by dx.
inline constexpr float kWenoEpsilon = 1e-6f;

/// Third-order WENO of the differences a, b, c in upwind order (Jiang and Peng, SIAM J. Sci. Comput. 21
/// (2000) 2126).
[[gnu::always_inline]] inline float weno3(float a, float b, float c) {
    const float smooth = kWenoEpsilon + (c - b) * (c - b), rough = kWenoEpsilon + (b - a) * (b - a);
    const float r = rough / smooth;  // ratio of smoothness indicators
    const float w = 1.0f / (1.0f + 2.0f * r * r);
    return 0.5f * (b + c) - 0.5f * w * (a - 2.0f * b + c);
}

/// Fifth-order WENO of five consecutive differences in upwind order; the value at the node between c and d.
/// Jiang and Peng (2000), equations 2.9 to 2.12.
[[gnu::always_inline]] inline float weno5(float a, float b, float c, float d, float e) {
    const auto square = [](float x) { return x * x; };
    const float s0 = 13.0f / 12.0f * square(a - 2.0f * b + c) + 0.25f * square(a - 4.0f * b + 3.0f * c);
    const float s1 = 13.0f / 12.0f * square(b - 2.0f * c + d) + 0.25f * square(b - d);
    const float s2 = 13.0f / 12.0f * square(c - 2.0f * d + e) + 0.25f * square(3.0f * c - 4.0f * d + e);
    const float w0 = 0.1f / square(s0 + kWenoEpsilon);
    const float w1 = 0.6f / square(s1 + kWenoEpsilon);
    const float w2 = 0.3f / square(s2 + kWenoEpsilon);
    const float q0 = (2.0f * a - 7.0f * b + 11.0f * c) / 6.0f;
    const float q1 = (-b + 5.0f * c + 2.0f * d) / 6.0f;
    const float q2 = (2.0f * c + 5.0f * d - e) / 6.0f;
    return (w0 * q0 + w1 * q1 + w2 * q2) / (w0 + w1 + w2);
}

/// One-sided differences of a row's nodes and squared upwind gradients for speeds of either sign. R = 1:
/// first order, both upwind differences summed (Engquist and Osher, Math. Comput. 36 (1981) 321). R = 2, 3:
/// WENO3, WENO5 of phi scaled by dx, so that weights do not depend on units; the larger counts (Godunov).
///
/// \param v        the row's first node.
/// \param strides  distances in memory between neighbours along the axes.
/// \note Forced inline: else compilers write rows node by node and call functions of nodes eight times.
template <int R>
[[gnu::always_inline]] inline void differences(const float* v, const int (&strides)[3], float dx,
                                               std::array<OneSided, 3>& d, Row& growing, Row& etching) {
    const float inv_dx = 1.0f / dx;
    const auto add_axis = [&](std::size_t a, std::size_t n, float& grow, float& etch)
        __attribute__((always_inline)) {
        const auto at = [&](int k) { return v[static_cast<std::ptrdiff_t>(n) + k * strides[a]]; };
        const auto slope = [&](int k) { return (at(k + 1) - at(k)) * inv_dx; };
        float minus, plus;
        if constexpr (R == 1) {
            minus = at(0) - at(-1);
            plus = at(1) - at(0);
        } else if constexpr (R == 2) {
            const float m2 = slope(-2), m1 = slope(-1), p0 = slope(0), p1 = slope(1);
            minus = dx * weno3(m2, m1, p0);
            plus = dx * weno3(p1, p0, m1);
        } else {
            const float m3 = slope(-3), m2 = slope(-2), m1 = slope(-1), p0 = slope(0), p1 = slope(1),
                        p2 = slope(2);
            minus = dx * weno5(m3, m2, m1, p0, p1);
            plus = dx * weno5(p2, p1, p0, m1, m2);
        }
        d[a].minus[n] = minus;
        d[a].plus[n] = plus;
        const float mp = std::max(minus, 0.0f), mn = std::min(minus, 0.0f);
        const float pp = std::max(plus, 0.0f), pn = std::min(plus, 0.0f);
        const float g0 = mp * mp, g1 = pn * pn, e0 = mn * mn, e1 = pp * pp;
        grow += R > 1 ? std::max(g0, g1) : g0 + g1;
        etch += R > 1 ? std::max(e0, e1) : e0 + e1;
    };
    growing.fill(0.0f);
    etching.fill(0.0f);
    // Loop orders that compilers vectorise: short inner loops they unroll to single nodes, long ones they
    // leave.
    if constexpr (R == 1) {
        for (std::size_t n = 0; n < kLanes; ++n)
            for (std::size_t a = 0; a < 3; ++a) add_axis(a, n, growing[n], etching[n]);
    } else {
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t n = 0; n < kLanes; ++n) add_axis(a, n, growing[n], etching[n]);
    }
}

}  // namespace sidewall::levelset
