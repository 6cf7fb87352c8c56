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

// The Monte Carlo tracer. The table on top of particle_history.cpp lists the phases of a particle's life.
namespace sidewall::flux {

struct TraceOptions {
    std::uint64_t rays = 1'000'000;  ///< source rays; rounded up to a multiple of the batches
    /// Target of FluxResult::largest_error: batches are added until every species has reached it or \p rays
    /// are spent. A species that has reached it is traced no further. Empty: all rays are traced.
    std::optional<double> relative_error{};
    std::uint64_t seed = 1;
    std::uint32_t time_step = 0;      ///< part of the random key: every time step draws other numbers
    std::uint32_t species_index = 0;  ///< of the first species traced; part of the random key, too
    std::uint32_t batches = 32;       ///< independent parts that give the standard errors; at least 16
    std::uint32_t task_rays =
        1024;  ///< rays a parallel task, in whole blocks; the result does not depend on it
    std::uint32_t max_bounces = 1'000'000;  ///< a particle that bounces more often counts as leaked
    /// Threshold of Russian roulette, in (0, 1]: a particle re-emitted with a smaller weight w continues with
    /// weight 1 at probability w, else it ends. 1 is analog Monte Carlo.
    double roulette = 1.0;
    /// Use adjoint sampling (adjoint.hpp) for a species alone in its pass that allows_adjoint, if `rays` give
    /// twelve paths a triangle: equally many on each, at most `rays` in all, in 4 to `batches` batches.
    bool adjoint = false;
    /// Fill FluxResult::reflected, for a species with direct flux (flux/direct.hpp) alone in its pass.
    bool reflected = false;
    /// Sticking probability by wedge, linear in between, where it depends on coverages; replaces
    /// Species::sticking. For several species, their values follow each other.
    std::span<const double> sticking_by_wedge{};
    /// Diffuse emission from the surface besides the source, by wedge, linear in between: a flux in units of
    /// the result, at least 0. A start is no arrival. For several species, their values follow each other.
    std::span<const double> emission_by_wedge{};
    std::function<void(double)> progress{};  ///< called with the finished fraction, by one thread at a time
    /// Asked often, by any thread; true ends the trace with Interrupted. Between two sums of \p shares, all
    /// ranks must give the same answer.
    std::function<bool()> stop{};
    Shares shares{};  ///< processes that share this trace; the result does not depend on their number
};

/// The balance of all particles' weights: emitted + gained = absorbed + escaped + leaked + lost. In units of
/// 2^-28 of a particle; exact modulo 2^64, which is 6.9e10 particles.
struct Ledger {
    std::uint64_t emitted = 0;
    std::uint64_t gained = 0, lost = 0;  ///< at Russian roulette
    std::uint64_t absorbed = 0, escaped = 0, leaked = 0;
    bool balanced() const { return emitted + gained == absorbed + escaped + leaked + lost; }
    bool operator==(const Ledger&) const = default;
};

/// One tally's flux, relative to an open horizontal plane.
struct TallyFlux {
    FluxField triangle;  ///< arrivals per triangle area
    FluxField wedge;     ///< barycentric tally: the piecewise linear flux, see Wedges
    FluxField vertex;    ///< barycentric tally over all wedges of a vertex
};

/// Numbers of a species' particles by how they ended, and the balance of their weights.
struct Counts {
    std::uint64_t emitted = 0, absorbed = 0, escaped = 0, leaked = 0;
    std::uint64_t arrivals = 0;  ///< hits on the surface, absorbed or not, of any weight
    Ledger ledger, redeposited;  ///< of the species; of the particles that its hits sputter
};

/// The fluxes of a species (arrivals, yields, redeposition), and the ends of its particles. Each history ends
/// once: emitted = absorbed + escaped + leaked. On a path shared with other species, a history counts as
/// absorbed when its weight becomes 0 or the path loses at roulette, and as escaped or leaked when the path
/// does while it has weight. Adjoint histories shadowed from the source count as escaped, with weight 0.
struct FluxResult : TallyFlux, Counts {
    std::vector<TallyFlux> others;  ///< one for each of Species::yields, then redeposition if any
    /// The parts of arrivals and of each yield from hits after a particle's first; empty unless asked for.
    std::vector<TallyFlux> reflected;
    std::uint64_t segments = 0;  ///< ray-scene intersections of the pass
    std::uint64_t rescued = 0;   ///< arrivals of the pass that rounding had put behind the surface, see fly
    /// sum(area * standard error) / sum(area * flux) over vertices; infinite without hits. If `reflected` is
    /// tallied, the error is that of the reflected arrivals, and both sums are weighted by their flux.
    double relative_error = 0.0;
    /// sum(area * standard error) of redeposition over vertices / all that is sputtered; 0 if nothing is.
    double redeposition_error = 0.0;
    bool adjoint = false;               ///< whether adjoint sampling was used
    double discretisation_error = 0.0;  ///< of RadiosityFlux, included in relative_error; 0 for Monte Carlo
    double seconds = 0.0;               ///< wall time of the pass
    /// Number of species in the pass, and this one's place among them. All of them have the same segments,
    /// rescued and seconds, so sum those of place 0 only.
    std::uint32_t pass_species = 1, pass_place = 0;
    /// The larger of relative_error and redeposition_error, which TraceOptions::relative_error bounds.
    double largest_error() const { return std::max(relative_error, redeposition_error); }
    /// Tally \p k in the order of tally_names.
    const TallyFlux& tally(std::size_t k) const { return k == 0 ? *this : others[k - 1]; }
};

/// Traces \p species from a plane above the surface until every particle is absorbed or gone.
///
/// The source covers the whole \p box with the species' distribution of directions about its beam. An
/// arriving particle sticks with its material's probability, else it is re-emitted by the species' rule.
/// Unbiased. Source points and directions are scrambled low-discrepancy sets, one for each batch.
/// \param scene      of \p mesh.
/// \param box        from lateral_box(mesh, ...).
/// \param materials  one id a triangle, at least 0, or empty if there is one material.
/// \param wedges     from make_wedges(mesh, ...).
/// \returns the same bits for the same mesh, species, rays, batches, seed, time step and species index, for
///          any number of threads and ranks and any task size.
/// \throws RecipeError for a species or options out of range, GeometryError for arrays of wrong length,
///         Interrupted if options.stop asked for it, NumericsError if sums might overflow (see Tally).
FluxResult trace_flux(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                      const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
                      const TraceOptions& options = {});

/// Groups \p species, by index, into passes: a pass traces up to four species with the same_paths together.
/// Ordered by the first species of each.
std::vector<std::vector<std::size_t>> passes_of(std::span<const Species> species);

/// Rays of the first round of a trace to a relative error. Fewer for a surface of revolution (\p round),
/// which has few triangles and does not use packets of rays.
constexpr std::uint64_t first_round(std::size_t triangles, bool round = false) {
    const std::uint64_t most = 2 * triangles + 16384;
    return round ? std::min<std::uint64_t>(most, 8 * triangles + 1024) : most;
}

/// trace_flux for several species. Those of one pass (passes_of) share paths, which carry a weight for each:
/// a pass costs as much as its species that sticks least. Every flux is unbiased, but those of a pass are
/// correlated. A species alone in its pass gets the bits of trace_flux.
///
/// \param options  random numbers of a pass are those of species_index + the place of its first species;
///                 sticking_by_wedge, unless empty, has species x wedges values.
/// \returns one result for each species, in their order.
/// \throws as trace_flux.
std::vector<FluxResult> trace_fluxes(const TriangleMesh& mesh, const surface::RayScene& scene,
                                     const LateralBox& box, std::span<const Species> species,
                                     std::span<const std::int32_t> materials, const Wedges& wedges,
                                     const TraceOptions& options = {});

/// Share of the particles that rounding may let through a surface without holes. A wide margin: of 1e8 rays
/// on the study's surfaces none leaks (flux_bench --table long).
constexpr double kRoundingLeaks = 1e-5;

/// Whether more particles leaked than rounding explains, by three standard deviations: the surface then has a
/// hole, an overlap or a piece turned inside out.
/// \param leaked, emitted  numbers of particles, of a FluxResult.
/// \param allowance        leaks tolerated besides kRoundingLeaks: where two sheets of an evolving surface
///                         touch, a few may leak, which should not end a run of few rays.
inline bool leaks_too_much(std::uint64_t leaked, std::uint64_t emitted, double allowance = 0.0) {
    const double expected = kRoundingLeaks * static_cast<double>(emitted);
    return static_cast<double>(leaked) > allowance + expected + 3.0 * std::sqrt(expected);
}

}  // namespace sidewall::flux
