#pragma once
#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <numbers>
#include <span>
#include <vector>

#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/tracer/flight.hpp"

namespace sidewall::flux {

/// Points of Gauss' rule in the unit interval: this and 1 less this.
inline constexpr double kGauss = 0.5 - 0.5 * std::numbers::inv_sqrt3;

/// Angles to the vertical between which the law of every source is close to a cubic; none if all are thermal.
std::vector<double> angles_of(std::span<const double> exponents);

/// The exchange of a profile without noise, by unknown; see exchange_samples.hpp for G and e.
struct ProfileView {
    Eigen::MatrixXd exchange;                 ///< G, symmetric
    std::vector<double> sky;                  ///< what of a uniform emission of 1 leaves to the sky
    std::vector<std::vector<double>> direct;  ///< e of each source
    std::uint64_t parts = 0;  ///< number of the parts of directions that were found, from all points
    double leaked = 0.0;      ///< share of all directions that meets the back of a facet, or nothing
};

/// Whether view_profile() takes a surface and the exponents of its sources: a straight one (so its sides mirror or repeat
/// it) that is a profile of at most 2,000 facets, and sources from thermal ones to cos^300.
bool can_be_viewed(const Geometry& geometry, const ProfileUnknowns& profile,
                   std::span<const double> exponents);

/// Finds what every facet sees. From two of its points (Gauss' rule; one if it is short, more if it is long beside the
/// distance to what it faces) the plane's directions are divided where what is seen first changes, and each part is weighed
/// by its share of Lambert's law, the difference of the sines of its angles to the normal: what crossed strings (Hottel 1954)
/// give between whole facets, with all that hides one from the other. Images of the profile across its sides are seen, too,
/// up to eight either way.
/// \param exponents  of the sources; the sky is divided so finely that their laws are resolved.
/// \param stop       asked often, by any thread; true ends with Interrupted.
/// \pre can_be_viewed().
/// \note O(n^2 log n); parallel; the same bits on any number of threads.
ProfileView view_profile(const Geometry& geometry, const ProfileUnknowns& profile,
                         std::span<const double> exponents, const std::function<bool()>& stop);

}  // namespace sidewall::flux
