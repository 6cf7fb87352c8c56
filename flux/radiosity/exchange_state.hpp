#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <vector>

#include "flux/radiosity/coarse_solver.hpp"
#include "flux/radiosity/exchange_samples.hpp"
#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/radiosity/radiosity.hpp"
#include "flux/radiosity/ray_densities.hpp"
#include "flux/radiosity/residual.hpp"

namespace sidewall::flux {

/// A bit for every group of rays.
constexpr std::uint32_t kAllGroups = (1u << kLinkGroups) - 1;

/// What an Exchange holds. Weights and direct terms in the groups are for one ray a group: those of all gathers
/// add up, and are divided by `group_rays`.
struct Exchange::State {
    Geometry geometry;
    const Wedges& wedges;
    Strip strip;  ///< tells the unknowns
    ExchangeOptions options;
    std::vector<double> source_exponents;
    std::optional<RayDensities> densities{};  ///< this and the next three: once needed
    MassMatrix mass{};
    Pieces pieces{};
    std::array<Eigen::MatrixXd, kLinkGroups / 2> piece_links{};  ///< of two groups each, see add_links
    std::array<LinkGroup, kLinkGroups> groups{};
    std::uint64_t group_rays = 0;
    std::uint64_t rays = 0, segments = 0, leaked = 0;
    std::uint32_t gathers = 0;
    bool focused = false;
    Residual residual{};
    double seconds = 0.0;

    /// The balanced rays of the groups whose bits are set; made when first asked for, until the next gather. Thread-safe.
    const BalancedLinks& balanced(std::uint32_t bits) const;
    double scale(std::uint32_t bits) const;  ///< of the weights of those groups
    void forget_balanced() { balanced_.clear(); }
    mutable std::mutex mutex_{};
    mutable std::map<std::uint32_t, BalancedLinks> balanced_{};
};

}  // namespace sidewall::flux
