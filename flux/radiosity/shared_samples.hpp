#pragma once
#include <span>

#include "flux/radiosity/gatherer.hpp"
#include "flux/shares.hpp"

namespace sidewall::flux {

/// Gives every rank the samples of all: job i is traced by rank i modulo the ranks, and added to zeros of the
/// others.
void share_samples(const Shares& shares, std::span<BlockSamples> found);

}  // namespace sidewall::flux
