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
    std::uint32_t time_step = 0;                        ///< other time steps draw other random numbers
    std::uint64_t most_bytes = std::uint64_t{2} << 30;  ///< memory that the samples may take
    std::function<void(double)>
        progress{};                ///< called with the finished fraction of a gather, by one thread at a time
    std::function<bool()> stop{};  ///< asked often, by any thread; true ends gather or solve with Interrupted
    Shares shares{};  ///< other processes that gather the same, see TraceOptions; all get all rays
};

/// Bytes that the samples of \p rays rays take, at most.
std::uint64_t exchange_bytes(std::uint64_t rays);
/// Bytes that the matrices of a profile seen whole take, by its unknowns.
std::uint64_t view_bytes(std::size_t unknowns);

/// Rays an unknown with which the first solve starts: the halves of fewer give no standard errors.
constexpr double kFirstRays = 12.0;

/// A bit for every group of rays.
constexpr std::uint32_t kAllGroups = (1u << kSampleGroups) - 1;

/// The exchange of a surface: samples of what passes between its points and between them and the source, from rays
/// traced so far.
class Exchange {
  public:
    /// Traces nothing yet. All arguments but the exponents and options must outlive the exchange.
    /// \param source_exponents  n of every cos^n source that will be solved for, in [0, 1e6]; each once.
    /// \throws RecipeError for an exponent out of range, GeometryError for arrays that do not fit \p mesh.
    Exchange(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
             const Wedges& wedges, std::vector<double> source_exponents, ExchangeOptions options = {});

    /// Whether the first gather takes the samples of view_profile(), which have no noise; no other adds to them.
    bool is_viewed() const { return state_->viewed; }

    /// Takes the view, or traces about \p rays more, equally many from every wedge; 64 an unknown give 1 to 2 % at low sticking. The
    /// same bits whatever the number of threads and ranks, and a function of the rays gathered before and the seed.
    /// \throws RecipeError if the samples would take more than most_bytes, with both figures; Interrupted;
    ///         NumericsError if too many rays pass through the surface, see leaks_too_much.
    void gather(std::uint64_t rays);

    /// Starts rays of further gathers half evenly, half where they lower the variance (importance sampling).
    /// \param variance  by triangle, what rays that started there so far contribute to it; in any unit.
    void set_start_variance(std::span<const double> variance);
    /// Places the residual rays of further gathers where the elements are expected to add to errors.
    /// \param error  by triangle, in any unit.
    void set_residual_error(std::span<const double> error);

    /// The data of an Exchange. Weights of the groups' samples are for one ray a group: those of all gathers add up,
    /// and are divided by `group_rays`.
    struct State {
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
        bool viewed = false;  ///< the exchange is a view
        std::optional<ProfileView> view{};
        std::optional<RingSky> sky{};  ///< of a surface of revolution: its groups' exits are no rays
        Residual residual{};
        double seconds = 0.0;

        /// The balanced rays of the groups whose bits are set; made when first asked for, until the next gather. Thread-safe.
        const BalancedSamples& balanced(std::uint32_t bits) const;
        double scale(std::uint32_t bits) const;  ///< of the weights of those groups
        void forget_balanced() { balanced_.clear(); }
        mutable std::mutex mutex_{};
        mutable std::map<std::uint32_t, BalancedSamples> balanced_{};
    };
    const State& state() const { return *state_; }

    /// Whether set_start_variance has been called, or is not needed.
    bool has_importance() const { return state_->has_importance || state_->viewed; }
    std::uint64_t rays() const { return state_->rays; }  ///< traced so far: a counter that no solve changes
    /// Traced besides, see residual.hpp: at most 4 % as many.
    std::uint64_t residual_rays() const { return state_->residual.rays.size(); }
    std::uint64_t segments() const { return state_->segments; }  ///< ray-scene intersections of both
    std::uint64_t samples() const;  ///< pairs of points that see each other, and points that see the source
    std::uint64_t leaked() const { return state_->leaked; }
    double seconds() const { return state_->seconds; }  ///< wall time of all gathers
    std::size_t unknowns() const { return state_->profile.unknowns.count(); }
    /// kFirstRays an unknown.
    std::uint64_t fewest_rays() const { return static_cast<std::uint64_t>(kFirstRays) * unknowns(); }
    std::uint64_t rays_left() const;  ///< that the next gather may trace within most_bytes

  private:
    std::unique_ptr<State> state_;
};

}  // namespace sidewall::flux
