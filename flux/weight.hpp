#pragma once
#include <cstdint>

namespace sidewall::flux {

/// The weight of one whole particle in the fixed point of weights and tallies. 64 bits hold kMostHits of them.
constexpr std::uint64_t kOne = std::uint64_t{1} << 28;

/// Hits of whole particles whose weight 64 bits hold.
constexpr std::uint64_t kMostHits = std::uint64_t{1} << 36;

}  // namespace sidewall::flux
