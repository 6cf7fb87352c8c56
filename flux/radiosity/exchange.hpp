#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "flux/radiosity/coarse_grid_solver.hpp"
#include "flux/radiosity/exchange_samples.hpp"
#include "flux/radiosity/profile_unknowns.hpp"
#include "flux/radiosity/ray_densities.hpp"
#include "flux/radiosity/residual.hpp"
#include "flux/radiosity/ring_sky.hpp"
#include "flux/shares.hpp"

namespace sidewall::flux {

struct ExchangeOptions {
    std::uint64_t seed = 1;
    std::uint32_t time_step = 0;                        ///< key of the random numbers besides the seed
    std::uint64_t most_bytes = std::uint64_t{2} << 30;  ///< memory that the samples may take
    /// Called with the finished fraction of a gather, by one thread at a time.
    std::function<void(double)> progress{};
    std::function<bool()> stop{};  ///< asked often, by any thread; true ends a gather with Interrupted
    Shares shares{};               ///< processes that share the rays of a gather; all of them get all samples
};

/// Upper bound on the bytes that the samples of \p rays rays take.
std::uint64_t exchange_bytes(std::uint64_t rays);
/// Bytes that the dense matrices of a viewed profile take (see Exchange::is_viewed).
std::uint64_t view_bytes(std::size_t unknowns);

/// Rays an unknown of the first solve: halves of fewer rays give no usable standard errors.
constexpr double kFirstRays = 12.0;

/// Bits of all groups of rays.
constexpr std::uint32_t kAllGroups = (1u << kSampleGroups) - 1;

/// The exchange of a surface: samples, from rays, of what passes between its points and from the source.
class Exchange {
  public:
    /// Makes an exchange without rays. All arguments but the exponents and options must outlive it.
    /// \param source_exponents  n of every cos^n source that will be solved for, in [0, 1e6]; each once.
    /// \throws RecipeError for an exponent out of range, GeometryError for arrays that do not fit \p mesh.
    Exchange(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
             const Wedges& wedges, std::vector<double> source_exponents, ExchangeOptions options = {});

    /// Whether the first gather computes the exchange without noise by view_profile(); others do nothing.
    bool is_viewed() const { return state_->viewed; }

    /// Traces about \p rays more rays, equally many from every wedge, or computes the view (is_viewed). 64
    /// rays an unknown give an error of 1 to 2 % at low sticking. The result depends on the seed and on the
    /// rays gathered before, not on the number of threads and ranks.
    /// \throws RecipeError if the samples would take more than most_bytes, with both figures; Interrupted;
    ///         NumericsError if too many rays pass through the surface, see leaks_too_much.
    void gather(std::uint64_t rays);

    /// Importance sampling: starts half of further gathers' rays where they lower the variance, half evenly.
    /// \param variance  by triangle: contribution of the rays that started there, in any unit.
    void set_start_variance(std::span<const double> variance);
    /// Places the residual rays of further gathers where the error of the linear elements is expected.
    /// \param error  expected error by triangle, in any unit.
    void set_residual_error(std::span<const double> error);

    /// The data of an Exchange. Sample weights are multiplied by the rays a group of their gather: their sums
    /// over all gathers, divided by `group_rays`, are estimates.
    struct State {
        Geometry geometry;
        const Wedges& wedges;
        ProfileUnknowns profile;
        ExchangeOptions options;
        std::vector<double> source_exponents;
        std::optional<RayDensities> densities{};  ///< made with the next three by the first gather
        WedgeMatrix mass{};
        Aggregates aggregates{};
        std::array<Eigen::MatrixXd, kSampleGroups / 2> aggregate_exchange{};  ///< sums over two groups each
        std::array<SampleGroup, kSampleGroups> groups{};
        std::uint64_t group_rays = 0;
        std::uint64_t rays = 0, segments = 0, leaked = 0;
        std::uint32_t gathers = 0;
        bool has_importance = false;
        bool viewed = false;  ///< the exchange is a view, not samples
        std::optional<ProfileView> view{};
        std::optional<RingSky> sky{};  ///< of a surface of revolution: replaces the exits of its rays
        Residual residual{};
        double seconds = 0.0;

        /// Balanced samples of the groups whose bits are set, kept until the next gather. Thread-safe.
        const BalancedSamples& balanced(std::uint32_t bits) const;
        double scale(std::uint32_t bits) const;  ///< factor on the weights of those groups
        void forget_balanced() { balanced_.clear(); }
        mutable std::mutex mutex_{};
        mutable std::map<std::uint32_t, BalancedSamples> balanced_{};
    };
    const State& state() const { return *state_; }

    /// Whether set_start_variance has been called, or is not needed.
    bool has_importance() const { return state_->has_importance || state_->viewed; }
    std::uint64_t rays() const { return state_->rays; }  ///< rays gathered so far, without residual rays
    /// Rays traced besides to measure the elements' error (residual.hpp): at most 4 % as many.
    std::uint64_t residual_rays() const { return state_->residual.rays.size(); }
    std::uint64_t segments() const { return state_->segments; }  ///< ray-scene intersections of all rays
    std::uint64_t samples() const;                               ///< number of pairs and exits
    std::uint64_t leaked() const { return state_->leaked; }
    double seconds() const { return state_->seconds; }  ///< wall time of all gathers
    std::size_t unknowns() const { return state_->profile.unknowns.count(); }
    /// Rays of the first solve: kFirstRays an unknown.
    std::uint64_t fewest_rays() const { return static_cast<std::uint64_t>(kFirstRays) * unknowns(); }
    std::uint64_t rays_left() const;  ///< rays that further gathers may trace within most_bytes

  private:
    std::unique_ptr<State> state_;
};

}  // namespace sidewall::flux
