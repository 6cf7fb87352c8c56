#pragma once
#include <span>

#include "flux/radiosity/gatherer.hpp"
#include "flux/shares.hpp"

namespace sidewall::flux {

/// Gives every rank what all have found: of job i, that of rank i modulo the ranks. The links and exits lie in sums whose
/// other terms are zero.
void share_finds(const Shares& shares, std::span<Found> found);

}  // namespace sidewall::flux
