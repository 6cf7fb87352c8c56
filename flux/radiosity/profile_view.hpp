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

/// Points of the two-point Gauss rule in the unit interval: kGauss and 1 - kGauss.
inline constexpr double kGauss = 0.5 - 0.5 * std::numbers::inv_sqrt3;

/// Angles to the vertical (radian) between which every source's law is nearly cubic; none if all are thermal.
std::vector<double> angles_of(std::span<const double> exponents);

/// The exchange of a profile, without noise, by unknown; see exchange_samples.hpp for G and e.
struct ProfileView {
    Eigen::MatrixXd exchange;                 ///< G, symmetric
    std::vector<double> sky;                  ///< part of a uniform emission of 1 that leaves to the sky
    std::vector<std::vector<double>> direct;  ///< direct flux e of each source
    std::uint64_t parts = 0;                  ///< number of intervals of directions, over all points
    double leaked = 0.0;  ///< share of all directions that meets a facet's back, or nothing
};

/// Whether view_profile() can take a surface and its sources: a straight profile (whose sides are reflective
/// or periodic) of at most 2,000 facets, and exponents from 1 (thermal) to 300.
bool can_be_viewed(const Geometry& geometry, const ProfileUnknowns& profile,
                   std::span<const double> exponents);

/// Computes the exchange by visibility in the plane. At two points of every facet (Gauss' rule; one if it is
/// short, more if it is long beside the distance to what it faces) directions are divided into intervals in
/// which the same segment is seen. An interval's weight is its share of Lambert's law: half the difference of
/// the sines of its angles to the normal. Between whole facets this is the method of crossed strings (Hottel
/// 1954), with occlusion. Up to eight images of the profile are seen across each side.
/// \param exponents  of the sources; the sky is divided finely enough to resolve their laws.
/// \param stop       asked often, by any thread; true ends with Interrupted.
/// \pre can_be_viewed().
/// \note O(n^2 log n); parallel; the same bits on any number of threads.
ProfileView view_profile(const Geometry& geometry, const ProfileUnknowns& profile,
                         std::span<const double> exponents, const std::function<bool()>& stop);

}  // namespace sidewall::flux
