#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "flux/lateral.hpp"
#include "flux/tally.hpp"
#include "flux/wedges.hpp"
#include "surface/ray_scene.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::flux {

/// Particles of one kind: neutrals, or a collimated beam without energy.
struct Species {
    std::string name = "neutral";
    double source_exponent = 1.0;       ///< n of the source's cos^n: 1 thermal, hundreds for a beam
    std::vector<double> sticking{1.0};  ///< probability in [0, 1] by material id, or one for all materials
};

struct TraceOptions {
    std::uint64_t rays = 1'000'000;  ///< source rays; rounded up to a multiple of the batches
    std::uint64_t seed = 1;
    std::uint32_t step = 0;  ///< time step: other steps and species draw other random numbers
    std::uint32_t species_index = 0;
    std::uint32_t batches = 32;              ///< independent parts the standard errors come from, at least 16
    std::uint32_t task_rays = 512;           ///< rays a parallel task; the result does not depend on it
    std::uint32_t max_bounces = 1'000'000;   ///< a particle that bounces more often counts as leaked
    std::function<void(double)> progress{};  ///< told the finished fraction, by one thread at a time
    std::function<bool()> stop{};  ///< asked often, by any thread; true ends the trace with Interrupted
};

/// Fluxes relative to an open plane, and what became of the particles: emitted = absorbed + escaped + leaked.
struct FluxResult {
    FluxField triangle;  ///< arrivals per triangle area
    FluxField wedge;     ///< barycentric tally: the piecewise linear flux, see Wedges
    FluxField vertex;    ///< the same over whole vertices
    std::uint64_t emitted = 0, absorbed = 0, escaped = 0, leaked = 0;
    std::uint64_t arrivals = 0;  ///< on the surface, absorbed or not
    std::uint64_t segments = 0;  ///< ray-scene intersections
    std::uint64_t rescued = 0;   ///< arrivals that rounding had put behind the surface, see fly
    double relative_error =
        0.0;  ///< sum(area * standard error) / sum(area * flux) over vertices; infinite without hits
    double seconds = 0.0;  ///< wall time of the trace
};

/// Traces \p species from a plane above the surface until every particle is absorbed or gone.
///
/// The source covers the whole \p box with directions cos^n about -z. An arriving particle sticks with its
/// material's probability, else it is re-emitted diffusely (Lambert) about the triangle's normal. Analog
/// Monte Carlo, unbiased; source points are stratified within a batch. \param scene      of \p mesh. \param
/// box        from lateral_box(mesh, ...). \param materials  one id a triangle, at least 0, or empty if there
/// is one material. \param wedges     from make_wedges(mesh, ...). \returns the same bits for the same mesh,
/// species, rays, batches, seed, step and species index, whatever the number
///          of threads.
/// \throws RecipeError for a species or options out of range, GeometryError for arrays that do not fit \p
/// mesh,
///         Interrupted if options.stop asked for it.
FluxResult trace_flux(const TriangleMesh& mesh, const surface::RayScene& scene, const LateralBox& box,
                      const Species& species, std::span<const std::int32_t> materials, const Wedges& wedges,
                      const TraceOptions& options = {});

/// Traces as often as it takes, each time with more rays, until relative_error <= \p target, and returns the
/// last trace. \throws NumericsError naming the error reached if options.rays do not suffice; as trace_flux
/// otherwise.
FluxResult trace_flux_to(double target, const TriangleMesh& mesh, const surface::RayScene& scene,
                         const LateralBox& box, const Species& species,
                         std::span<const std::int32_t> materials, const Wedges& wedges,
                         const TraceOptions& options);

}  // namespace sidewall::flux
