#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "flux/radiosity/coarse_grid_solver.hpp"
#include "flux/radiosity/exchange.hpp"
#include "flux/radiosity/exchange_samples.hpp"
#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/radiosity/ray_densities.hpp"
#include "flux/radiosity/residual.hpp"

namespace sidewall::flux {

/// A bit for every group of rays.
constexpr std::uint32_t kAllGroups = (1u << kSampleGroups) - 1;

/// The data of an Exchange. Weights of the groups' samples are for one ray a group: those of all gathers add up,
/// and are divided by `group_rays`.
struct Exchange::State {
    Geometry geometry;
    const Wedges& wedges;
    ProfileUnknowns profile;
    ExchangeOptions options;
    std::vector<double> source_exponents;
    std::optional<RayDensities> densities{};  ///< this and the next three: once needed
    WedgeMatrix mass{};
    Aggregates aggregates{};
    std::array<Eigen::MatrixXd, kSampleGroups / 2> aggregate_exchange{};  ///< of two groups each
    std::array<SampleGroup, kSampleGroups> groups{};
    std::uint64_t group_rays = 0;
    std::uint64_t rays = 0, segments = 0, leaked = 0;
    std::uint32_t gathers = 0;
    bool has_importance = false;
    Residual residual{};
    double seconds = 0.0;

    /// The balanced rays of the groups whose bits are set; made when first asked for, until the next gather. Thread-safe.
    const BalancedSamples& balanced(std::uint32_t bits) const;
    double scale(std::uint32_t bits) const;  ///< of the weights of those groups
    void forget_balanced() { balanced_.clear(); }
    mutable std::mutex mutex_{};
    mutable std::map<std::uint32_t, BalancedSamples> balanced_{};
};

}  // namespace sidewall::flux
