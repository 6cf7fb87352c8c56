#pragma once
#include <cstdint>

namespace sidewall::flux {

/// The weight of one whole particle in the fixed point of weights and tallies. 64 bits hold 2^36 of them.
constexpr std::uint64_t kOne = std::uint64_t{1} << 28;

}  // namespace sidewall::flux
