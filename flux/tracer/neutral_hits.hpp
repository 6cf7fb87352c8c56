#pragma once
#include "flux/tracer/hits.hpp"

namespace sidewall::flux {

/// The hits of one bounce of neutrals that do nothing but stick or go on diffusely: tallies and absorbs them;
/// survivors of roulette move up in \p rays, ready to fly on.
void hit_neutrals(const Trace& trace, Bundle& bundle, Worker& worker, Rays& rays, const Event& event);

}  // namespace sidewall::flux
