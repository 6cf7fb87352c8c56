#pragma once
#include <cstdint>

namespace sidewall::flux {

/// The share of the particles that rounding may take through a surface without holes. A wide margin: 1e8 rays on
/// the study's surfaces leak none (flux_bench --table long).
constexpr double kRoundingLeaks = 1e-5;

/// Leaks that chance gives a trace of few rays, which may have none by that share.
constexpr double kChanceLeaks = 3.0;

/// Whether more particles leaked than rounding explains, so that the surface has a hole, an overlap or a piece
/// turned inside out.
/// \param leaked, emitted  particles, of a FluxResult.
/// \param allowance        leaks that are put up with besides kRoundingLeaks: a few single ones, where two
///                         sheets of an evolving surface touch, are no reason to end a run of few rays.
constexpr bool leaks_too_much(std::uint64_t leaked, std::uint64_t emitted, double allowance = 0.0) {
    return static_cast<double>(leaked) > allowance + kRoundingLeaks * static_cast<double>(emitted);
}

}  // namespace sidewall::flux
