#pragma once
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/tracer/flight.hpp"

namespace sidewall::flux {

/// What the rings of a surface of revolution see of the sky, without noise, by unknown.
struct RingSky {
    std::vector<ExitSample> exits;                 ///< all that leaves: no ray is needed for it
    std::map<double, std::vector<double>> direct;  ///< e of a source cos^n, by n
    std::vector<double> leaving;                   ///< what of a uniform emission of 1 leaves
};

/// Looks from points of every ring, at azimuths all around, past all other rings, whose elevations there are known: what
/// is left of each half plane is the sky. Paths that meet the mirror around go on, eight times at most.
/// \param stop  asked often, by any thread; true ends with Interrupted.
/// \pre \p geometry has a revolution.
/// \note O(n log n); parallel; the same bits on any number of threads.
RingSky sky_of_rings(const Geometry& geometry, const ProfileUnknowns& profile,
                     std::span<const double> exponents, const std::function<bool()>& stop);

}  // namespace sidewall::flux
