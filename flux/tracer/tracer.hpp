#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/shares.hpp"
#include "flux/species.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

// The Monte Carlo tracer. A particle's life, phase by phase, is the table on top of particle_history.cpp.
namespace sidewall::flux {

struct TraceOptions {
    std::uint64_t rays = 1'000'000;  ///< source rays; rounded up to a multiple of the batches
    /// Batches are added until FluxResult::largest_error is at most this or \p rays are spent, whichever comes first;
    /// of several species, for those that have not reached it. Empty: all rays are traced.
    std::optional<double> relative_error{};
    std::uint64_t seed = 1;
    std::uint32_t time_step = 0;      ///< other time steps and species draw other random numbers
    std::uint32_t species_index = 0;  ///< of the first species traced
    std::uint32_t batches = 32;       ///< independent parts the standard errors come from, at least 16
    std::uint32_t task_rays =
        1024;  ///< rays a parallel task, in whole blocks; the result does not depend on it
    std::uint32_t max_bounces = 1'000'000;  ///< a particle that bounces more often counts as leaked
    /// Russian roulette: a particle re-emitted with a weight below this threshold, in (0, 1], survives with that
    /// probability, and weight 1, or ends. 1 is analog Monte Carlo.
    double roulette = 1.0;
    /// Adjoint sampling (adjoint.hpp) for a species alone in its pass that allows_adjoint, if rays are enough for twelve
    /// paths a triangle: equally many from every triangle, at most so many, in 4 to `batches` batches.
    bool adjoint = false;
    /// FluxResult::reflected is asked for. Only of a species with direct flux (flux/direct.hpp), alone in its pass.
    bool reflected = false;
    /// Sticking probability by wedge, linear in between, where coverages decide it: replaces
    /// Species::sticking. Of several species: one after the other.
    std::span<const double> sticking_by_wedge{};
    /// Diffuse emission from the surface beside the source, by wedge, linear in between: a flux in the units of the
    /// result, at least 0. Its own start does not count as an arrival. Of several species: one after the other.
    std::span<const double> emission_by_wedge{};
    std::function<void(double)> progress{};  ///< called with the finished fraction, by one thread at a time
    /// Asked often, by any thread; true ends the trace with Interrupted. All ranks answer the same between two sums of
    /// \p shares.
    std::function<bool()> stop{};
    Shares shares{};  ///< other processes that trace the same; the result does not depend on them
};

/// The balance of all particles' weights, in units of 2^-28 of a particle; exact, modulo 2^64 (which 6.9e10 particles
/// fill): emitted + gained = absorbed + escaped + leaked + lost.
struct Ledger {
    std::uint64_t emitted = 0;
    std::uint64_t gained = 0, lost = 0;  ///< to Russian roulette
    std::uint64_t absorbed = 0, escaped = 0, leaked = 0;
    bool balanced() const { return emitted + gained == absorbed + escaped + leaked + lost; }
    bool operator==(const Ledger&) const = default;
};

/// One tally's flux, relative to an open horizontal plane.
struct TallyFlux {
    FluxField triangle;  ///< per triangle area
    FluxField wedge;     ///< barycentric tally: the piecewise linear flux, see Wedges
    FluxField vertex;    ///< the same over whole vertices
};

/// Numbers of a species' particles by their end, and their weights' balance.
struct Counts {
    std::uint64_t emitted = 0, absorbed = 0, escaped = 0, leaked = 0;
    std::uint64_t arrivals = 0;  ///< on the surface, absorbed or not, of whatever weight
    Ledger ledger, redeposited;  ///< of the species, and of what its hits sputter
};

/// Arrivals, what else the species tallies, and what became of the particles. Each history ends once:
/// emitted = absorbed + escaped + leaked. One that shares its path with other species' ends as absorbed when
/// its weight comes to 0 or the path loses at roulette, as escaped or leaked when the path does with any of
/// its weight. Adjoint histories that the surface hides from the source escape and weigh nothing.
struct FluxResult : TallyFlux, Counts {
    std::vector<TallyFlux> others;  ///< one for each of Species::yields, then redeposition if there is any
    /// The parts of the arrivals and of each yield that are not of a particle's first hit; empty unless asked for.
    std::vector<TallyFlux> reflected;
    std::uint64_t segments = 0;  ///< ray-scene intersections of the pass
    std::uint64_t rescued = 0;   ///< its arrivals that rounding had put behind the surface, see fly
    /// sum(area * standard error) / sum(area * flux) over vertices, infinite without hits; where `reflected` is known apart,
    /// the error is that of reflected arrivals, and both sums are over where these come to (weighted by their flux).
    double relative_error = 0.0;
    /// The redeposition's sum(area * standard error) over vertices, as a share of all that is sputtered; 0 without.
    double redeposition_error = 0.0;
    bool adjoint = false;               ///< see TraceOptions
    double discretisation_error = 0.0;  ///< of RadiosityFlux, whose relative_error has it in it; 0 of paths
    double seconds = 0.0;               ///< wall time of the pass
    /// Species that the pass traced together, and this one's place among them: segments, rescued and seconds
    /// are the same for all of them, so sum those of place 0.
    std::uint32_t pass_species = 1, pass_place = 0;
    /// The larger of the relative errors of arrivals and of redeposition, which TraceOptions::relative_error bounds.
    double largest_error() const { return std::max(relative_error, redeposition_error); }
    /// Tally \p k in the order of tally_names.
    const TallyFlux& tally(std::size_t k) const { return k == 0 ? *this : others[k - 1]; }
};

/// Traces \p species from a plane above the surface until every particle is absorbed or gone.
///
/// The source covers the whole \p box with directions cos^n about the species' beam. An arriving particle
/// sticks with its material's probability, else it is re-emitted as the species says. Unbiased. Source points
/// and directions are scrambled low-discrepancy sets, one a batch.
/// \param scene      of \p mesh.
/// \param box        from lateral_box(mesh, ...).
/// \param materials  one id a triangle, at least 0, or empty if there is one material.
/// \param wedges     from make_wedges(mesh, ...).
/// \returns the same bits for the same mesh, species, rays, batches, seed, time step and species index, whatever
///          the number of threads, of ranks and the task size.
/// \throws RecipeError for a species or options out of range, GeometryError for arrays that do not fit \p
///         mesh, Interrupted if options.stop asked for it, NumericsError if a batch's sums might overflow, see Tally.
FluxResult trace_flux(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                      const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
                      const TraceOptions& options = {});

/// Passes over \p species, as their indices: a pass traces up to four species with the same_paths together. In the order of
/// the first of each.
std::vector<std::vector<std::size_t>> passes_of(std::span<const Species> species);

/// Rays of the first round of a trace to a relative error. A round profile has few triangles, and packets of rays serve
/// others alone.
constexpr std::uint64_t first_round(std::size_t triangles, bool round = false) {
    const std::uint64_t most = 2 * triangles + 16384;
    return round ? std::min<std::uint64_t>(most, 8 * triangles + 1024) : most;
}

/// trace_flux for several species, those with the same_paths together, see passes_of: a path carries a weight
/// of each, so that it costs what the one that sticks least does. Every flux is unbiased, but those of a pass
/// are correlated. A species alone in its pass has the bits that trace_flux gives it.
///
/// \param options  random numbers of a pass are those of species_index + the place of its first species;
///                 sticking_by_wedge, unless empty, has species x wedges values.
/// \returns one result a species, in their order.
/// \throws as trace_flux.
std::vector<FluxResult> trace_fluxes(const TriangleMesh& mesh, const surface::RayScene& scene,
                                     const LateralBox& box, std::span<const Species> species,
                                     std::span<const std::int32_t> materials, const Wedges& wedges,
                                     const TraceOptions& options = {});

/// The share of the particles that rounding may take through a surface without holes. A wide margin: 1e8 rays on
/// the study's surfaces leak none (flux_bench --table long).
constexpr double kRoundingLeaks = 1e-5;

/// Whether more particles leaked than rounding explains, by three standard deviations, so that the surface has
/// a hole, an overlap or a piece turned inside out.
/// \param leaked, emitted  particles, of a FluxResult.
/// \param allowance        leaks that are put up with besides kRoundingLeaks: a few single ones, where two
///                         sheets of an evolving surface touch, are no reason to end a run of few rays.
inline bool leaks_too_much(std::uint64_t leaked, std::uint64_t emitted, double allowance = 0.0) {
    const double expected = kRoundingLeaks * static_cast<double>(emitted);
    return static_cast<double>(leaked) > allowance + expected + 3.0 * std::sqrt(expected);
}

}  // namespace sidewall::flux
