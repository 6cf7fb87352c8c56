#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/shares.hpp"
#include "flux/species.hpp"
#include "flux/tracer/tracer.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

// Fluxes of particles that re-emit diffusely, by solving their balance on the surface instead of following
// them:
//
//     Gamma = E + F (1 - s) Gamma
//
// The flux Gamma is linear over every triangle, see Wedges. The exchange F does not depend on sticking: rays
// between points of the surface are traced once, and every species, sticking and coverage after that is a
// sparse solve that traces nothing. Reciprocity makes the exchange symmetric: a ray links its two ends both
// ways, so a closed cavity without sticking gets flux 1 exactly, and what noise does to a deep floor is the
// product of two small differences along each ray (links.hpp says more).
namespace sidewall::flux {

struct ExchangeOptions {
    std::uint64_t seed = 1;
    std::uint32_t time_step = 0;                        ///< other time steps draw other random numbers
    std::uint64_t most_bytes = std::uint64_t{2} << 30;  ///< the links may take
    std::function<void(double)>
        progress{};                ///< told the finished fraction of a gather, by one thread at a time
    std::function<bool()> stop{};  ///< asked often, by any thread; true ends gather or solve with Interrupted
    Shares shares{};  ///< other processes that gather the same, see TraceOptions; all get all rays
};

/// Bytes that the links of \p rays rays take, at most.
std::uint64_t exchange_bytes(std::uint64_t rays);

/// What passes between the points of a surface, and between them and the source: rays traced so far.
class Exchange {
  public:
    /// Traces nothing yet. All arguments but the exponents and options must outlive the exchange.
    /// \param source_exponents  n of every cos^n source that will be solved for, in [0, 1e6]; each once.
    /// \throws RecipeError for an exponent out of range, GeometryError for arrays that do not fit \p mesh.
    Exchange(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
             const Wedges& wedges, std::vector<double> source_exponents, ExchangeOptions options = {});
    ~Exchange();
    Exchange(Exchange&&) noexcept;
    Exchange& operator=(Exchange&&) noexcept;

    /// Traces about \p rays more, as many from every wedge; 64 an unknown give 1 to 2 % at low sticking. The
    /// same bits whatever the number of threads and ranks, and a function of the rays gathered before and the seed.
    /// \throws RecipeError if the links would take more than most_bytes, with both figures; Interrupted;
    ///         NumericsError if too many rays pass through the surface, see leaks_too_much.
    void gather(std::uint64_t rays);

    /// Starts rays of further gathers half evenly, half where they lower the variance.
    /// \param variance  by triangle, what rays that started there so far contribute to it; in any unit.
    void start_where(std::span<const double> variance);
    bool is_focused() const;  ///< start_where has been called
    /// Has further gathers look for what the elements add to errors where it is expected.
    /// \param error  by triangle, in any unit.
    void look_where(std::span<const double> error);

    std::uint64_t rays() const;           ///< traced so far: a counter that no solve changes
    std::uint64_t residual_rays() const;  ///< traced besides, see residual.hpp: at most 4 % as many
    std::uint64_t segments() const;       ///< ray-scene intersections of both
    std::uint64_t links() const;  ///< pairs of points that see each other, and points that see the source
    std::uint64_t leaked() const;
    std::uint64_t bytes() const;  ///< memory that the links take
    double seconds() const;       ///< wall time of all gathers
    std::size_t unknowns() const;
    std::uint64_t fewest_rays() const;  ///< 12 an unknown: halves of fewer tell no errors
    /// What of \p rays the next gather may trace within most_bytes.
    std::uint64_t rays_left() const;

    struct State;
    const State& state() const { return *state_; }

  private:
    std::unique_ptr<State> state_;
};

/// One species to solve for. Spans of one value a wedge.
struct DiffuseSpecies {
    std::string name = "neutral";        ///< for messages
    double source_exponent = 1.0;        ///< one of the exchange's
    double source = 1.0;                 ///< flux on an open horizontal plane; 0 if nothing comes from above
    std::span<const double> sticking{};  ///< in [0, 1], see sticking_by_wedge
    /// What starts on the surface and is no re-emission (sputtered, desorbed), diffusely: a flux in the units
    /// of the result, at least 0; empty if nothing does. Its own start does not count as an arrival.
    std::span<const double> emission{};
    std::span<const double>
        guess{};  ///< a flux to start the solver from, e.g. of the coverage iteration before
};

struct SolveOptions {
    /// Mean of what one more relaxation changes an unknown by, relative to it or to 1e-7 of the brightest.
    double tolerance = 1e-5;
    std::uint32_t most_iterations = 2000;
    bool errors = true;          ///< standard errors, for about twice as much time; false leaves them 0
    std::uint32_t halvings = 3;  ///< of the rays that errors come from, 1 to 3: with fewer they scatter more
    bool unbiased = true;        ///< takes off what the halves of the rays show of the bias; free with errors
    /// Of solve_fluxes_to: targets are for the statistical errors alone, as two methods on one mesh are compared.
    bool of_rays = false;
    std::function<bool()> stop{};
};

/// A solved flux. Per triangle, wedge and vertex as the tracer's, see TallyFlux.
struct RadiosityFlux : TallyFlux {
    double relative_error = 0.0;  ///< the root of the sum of the squares of the next two; 0 without errors
    /// sum(area * standard error) / sum(area * flux) over vertices, as FluxResult's: of the rays.
    double statistical_error = 0.0;
    /// What linear elements add: sum(area * rms error of a triangle) / sum(area * flux), see residual.hpp.
    double discretisation_error = 0.0;
    double absorbed = 0.0, escaped = 0.0;  ///< of what source and surface emit; their sum is 1
    std::uint32_t iterations = 0;          ///< of the solver, without those for the errors
    double seconds = 0.0;                  ///< wall time
};

/// One value a wedge of a species' sticking by material.
/// \throws as trace_flux.
std::vector<double> sticking_by_wedge(const Wedges& wedges, std::span<const std::int32_t> materials,
                                      const Species& species);

/// Why radiosity cannot take \p species, for a message, or empty if it can: it must go_on_diffusely from a
/// source that is not tilted.
std::string why_not_radiosity(const Species& species);

/// Solves for \p species on the rays gathered so far. Traces no ray.
///
/// The answer is consistent, not unbiased: its bias falls as 1/rays, and what the two halves of the rays show of
/// it is taken off. Standard errors come from what the two halves differ by, in `halvings` ways to halve the rays.
/// \throws RecipeError for values out of range or an exponent that was not gathered, GeometryError for arrays
///         that do not fit, Interrupted, NumericsError if the balance has no solution (nothing sticks and
///         nothing escapes) or the solver does not converge, saying why.
RadiosityFlux solve_flux(const Exchange& exchange, const DiffuseSpecies& species,
                         const SolveOptions& options = {});

/// Has further gathers of \p exchange start their rays where they lower the relative errors of all \p fluxes most, as adjoint
/// solutions on the rays so far tell. Traces no ray.
void focus(Exchange& exchange, std::span<const DiffuseSpecies> species, std::span<const RadiosityFlux> fluxes,
           const SolveOptions& options = {});

/// Has further gathers look for what linear elements add to the errors of all \p fluxes where their slopes change.
void look_where_expected(Exchange& exchange, std::span<const RadiosityFlux> fluxes);

/// Gathers until \p exchange has \p rays, most of them where the first ones, its own included, say they count for \p species.
/// \throws as Exchange::gather and solve_flux.
void gather_for(std::span<const DiffuseSpecies> species, Exchange& exchange, std::uint64_t rays,
                const SolveOptions& options = {});

/// Share of a relative error asked for above which the linear elements leave rays nothing to mend.
inline constexpr double kElementsAlone = 0.9;

/// Gathers until the relative_error of every one of \p species is at most its target, or rays or memory are
/// spent; the results' relative_error tells which. Where the elements alone are off by nearly the target, rays do not help: then
/// until the statistical_error is. Solves no closer than a two-hundredth of the least target.
/// \param targets    by species, above 0.
/// \param most_rays  to gather in all, those that \p exchange has included.
std::vector<RadiosityFlux> solve_fluxes_to(std::span<const double> targets, Exchange& exchange,
                                           std::span<const DiffuseSpecies> species, std::uint64_t most_rays,
                                           const SolveOptions& options = {});

/// What auto lets radiosity gather, times the rays of the paths whose error it is to reach: it costs less than they do, and an
/// estimate that is off by more is not followed.
constexpr std::uint64_t kMostOfAuto = 4;

/// Which method takes less CPU time to a relative error, as estimated.
struct MethodChoice {
    bool radiosity = false;  ///< takes less from here on, on an exchange that is gone on with
    double monte_carlo_cost = 0.0, radiosity_cost = 0.0;  ///< CPU time, in segments of the tracer's
    double spent = 0.0;         ///< what the rays gathered to choose cost, a part of radiosity_cost
    double target = 0.0;        ///< the relative error they are for
    double rays = 0.0;          ///< an unknown that radiosity gathers; 0 if not estimated
    std::vector<double> guess;  ///< by wedge, of the first rays: to start a solver from; empty without them
    std::string why_not;  ///< radiosity is out of the question, whatever the cost; empty if it can be taken
};

/// Estimates what both methods take to a relative error of \p target, from a few thousand particles of the
/// tracer's and, where those cost more, radiosity's first rays. The same choice on every machine.
/// \param target    0: what the tracer reaches with options.rays.
/// \param exchange  of the surface and the species' source; gathers the first rays if it has none, with which it can go on.
/// \param once      whether a process is expected to trace or solve nothing else, as `sidewall flux` is: then radiosity takes longer.
/// \throws as trace_flux.
MethodChoice choose_method(double target, Exchange& exchange, const Species& species,
                           std::span<const std::int32_t> materials, const TraceOptions& options,
                           bool once = false);

}  // namespace sidewall::flux
