#pragma once
#include <cmath>
#include <cstdint>

namespace sidewall::flux {

/// The share of the particles that rounding may take through a surface without holes. A wide margin: 1e8 rays on
/// the study's surfaces leak none (flux_bench --table long).
constexpr double kRoundingLeaks = 1e-5;

/// Whether more particles leaked than rounding explains, by three standard deviations, so that the surface has
/// a hole, an overlap or a piece turned inside out.
/// \param leaked, emitted  particles, of a FluxResult.
/// \param allowance        leaks that are put up with besides kRoundingLeaks: a few single ones, where two
///                         sheets of an evolving surface touch, are no reason to end a run of few rays.
inline bool leaks_too_much(std::uint64_t leaked, std::uint64_t emitted, double allowance = 0.0) {
    const double expected = kRoundingLeaks * static_cast<double>(emitted);
    return static_cast<double>(leaked) > allowance + expected + 3.0 * std::sqrt(expected);
}

}  // namespace sidewall::flux
