#pragma once
#include <cmath>

// Tolerances against rounding, which differs with the wafer's place and the unit of length.
namespace sidewall::levelset {

/// Distances count as equal if they differ by less than this, in cells.
inline constexpr float kTie = 1e-4f;

/// The distance, or 0 if it differs from that by rounding alone: a node on the front is outside.
template <class Real>
Real without_rounding(Real distance, Real dx) {
    constexpr auto kNothing = static_cast<Real>(1e-6);  // cells
    return std::abs(distance) < kNothing * dx ? Real{0} : distance;
}

}  // namespace sidewall::levelset
