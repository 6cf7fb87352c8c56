#pragma once
#include <cstdint>

#include "flux/rays.hpp"
#include "flux/tracer/flight.hpp"

namespace sidewall::flux {

/// What fly_block counts.
struct FlightCounts {
    std::uint64_t segments = 0;  ///< ray-scene intersections
    std::uint64_t rescued = 0;   ///< see fly
};

/// fly() for all \p rays, in packets of eight: sets what they hit, and the start and direction of their
/// last segment. The few that hit anything but the front of another triangle, and do not clearly leave,
/// fly again one by one, with fly()'s care. The result depends on the order of the rays by rounding only, and not on
/// the thread.
void fly_block(const Geometry& geometry, Rays& rays, FlightCounts& counts);

/// The same for particles whose free paths end: row i flies at most \p free_path[i], through sides, in world units.
/// Those that get that far have the triangle kCollided, and where they are is not told.
void fly_block_within(const Geometry& geometry, Rays& rays, const Column<float>& free_path,
                      FlightCounts& counts);

}  // namespace sidewall::flux
