#pragma once
#include <cmath>

// What rounding, which differs with the wafer's place and the unit of length, must not decide.
namespace sidewall::levelset {

/// Cells: what rounding may make of equal distances.
inline constexpr float kTie = 1e-4f;

/// A distance without what rounding makes of zero: a node on the front is outside.
template <class Real>
Real without_rounding(Real distance, Real dx) {
    constexpr auto kNothing = static_cast<Real>(1e-6);  // cells
    return std::abs(distance) < kNothing * dx ? Real{0} : distance;
}

}  // namespace sidewall::levelset
