#pragma once
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "flux/radiosity/exchange_samples.hpp"
#include "flux/tracer/flight.hpp"

namespace sidewall::flux {

/// The sky seen by the rings of a surface of revolution, without noise, by unknown.
struct RingSky {
    std::vector<ExitSample> exits;                 ///< exits that stand for all rays that leave
    std::map<double, std::vector<double>> direct;  ///< direct flux e of a source cos^n, by n
    std::vector<double> leaving;                   ///< part of a uniform emission of 1 that leaves
};

/// Computes the sky visible from points of every ring: for azimuths all around, removes the slopes at which
/// other rings hide it. Paths are reflected at the outer cylinder, at most eight times.
/// \param stop  asked often, by any thread; true ends with Interrupted.
/// \pre \p geometry has a revolution.
/// \note O(n log n); parallel; the same bits on any number of threads.
RingSky sky_of_rings(const Geometry& geometry, const ProfileUnknowns& profile,
                     std::span<const double> exponents, const std::function<bool()>& stop);

}  // namespace sidewall::flux
