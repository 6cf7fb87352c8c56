#include "app/process/species_flux.hpp"

#include <fmt/format.h>

#include "flux/averaging.hpp"
#include "flux/leaks.hpp"
#include "flux/smoothing.hpp"

namespace sidewall::app {
namespace {

// Single leaks are rounding where two sheets touch; they must not end a run of few rays. As many as
// flux::kRoundingLeaks allows in the million rays that a species traces by default.
constexpr double kSingleLeaks = 10.0;

// Refuses a surface with holes, and tells of noise above what was asked for.
void check_trace(const Recipe& recipe, const flux::Species& species, const flux::FluxResult& result,
                 std::uint32_t time_step) {
    if (result.others.size() + 1 != flux::tally_count(species))
        throw NumericsError(fmt::format("species {}: the tracer did not count its yields", species.name));
    if (flux::leaks_too_much(result.leaked, result.emitted, kSingleLeaks))
        throw LeakError(fmt::format(
            "species {}: {} of {} particles leaked through the surface; use a smaller grid_spacing or a "
            "milder simplification",
            species.name, result.leaked, result.emitted));
    if (recipe.flux.relative_error && !(result.relative_error <= *recipe.flux.relative_error))
        fmt::print(stderr,
                   "time step {}: species {}: relative error {:.3g} after {} rays, above the {:.3g} asked "
                   "for: allow more flux.max_rays or ask for less\n",
                   time_step, species.name, result.relative_error, result.emitted,
                   *recipe.flux.relative_error);
}

// As counted.
std::vector<flux::FluxResult> trace(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                                    const SurfaceFlux& arriving, std::span<const double> sticking,
                                    const TraceRequest& request) {
    flux::TraceOptions options;
    options.rays =
        static_cast<std::uint64_t>(recipe.flux.relative_error ? recipe.flux.max_rays : recipe.flux.rays);
    options.batches = static_cast<std::uint32_t>(recipe.flux.batches);
    options.seed = static_cast<std::uint64_t>(recipe.flux.seed);
    options.time_step = request.key;
    options.sticking_by_wedge = sticking;
    options.progress = request.progress;
    options.stop = request.stop;
    const auto traced = [&](auto&& tracer) {
        return tracer(surface.traced(), *surface.scene, surface.box, model.species, arriving.materials,
                      arriving.wedges, options);
    };
    std::vector<flux::FluxResult> results =
        recipe.flux.relative_error ? traced([&](auto&&... parts) {
            return flux::trace_fluxes_to(*recipe.flux.relative_error, parts...);
        })
                                   : traced([](auto&&... parts) { return flux::trace_fluxes(parts...); });
    for (std::size_t k = 0; k < results.size(); ++k)
        check_trace(recipe, model.species[k], results[k], request.key);
    return results;
}

// Arrivals that would make as much flux with weight 1 each. A species traced on the paths of one that sticks
// less arrives far more often, with little weight.
std::uint64_t whole_arrivals(const flux::LateralBox& box, const flux::Wedges& wedges,
                             const flux::FluxResult& result) {
    if (result.pass_species == 1) return result.arrivals;
    double sum = 0.0;
    for (std::size_t w = 0; w < wedges.count(); ++w) sum += wedges.area[w] * result.wedge.flux[w];
    return static_cast<std::uint64_t>(sum * static_cast<double>(result.emitted) / box.area() + 0.5);
}

// The fluxes that models see, from those counted.
void smooth(const Recipe& recipe, const TracedSurface& surface, SurfaceFlux& arriving) {
    TraceReport& trace = *arriving.trace;
    arriving.flux.clear();
    std::vector<const flux::TallyFlux*> tallies;
    for (const flux::FluxResult& result : trace.species)
        for (std::size_t k = 0; k <= result.others.size(); ++k) {
            tallies.push_back(&result.tally(k));
            arriving.flux.push_back(
                flux::smoothed_flux(surface.traced(), arriving.wedges, result.tally(k).wedge,
                                    whole_arrivals(surface.box, arriving.wedges, result)));
            trace.error.push_back(result.tally(k).wedge.error);
        }
    if (recipe.flux.averaging == 0.0) return;
    std::vector<flux::Unaveraged> fluxes;
    for (std::size_t k = 0; k < tallies.size(); ++k)
        fluxes.push_back({arriving.flux[k], tallies[k]->triangle.error});
    std::vector<flux::FluxField> averages = flux::averaged(surface.traced(), surface.box, arriving.wedges,
                                                           arriving.materials, fluxes, recipe.flux.averaging);
    for (std::size_t k = 0; k < tallies.size(); ++k) {
        arriving.flux[k] = std::move(averages[k].flux);
        trace.error[k] = std::move(averages[k].error);
    }
}

}  // namespace

void trace_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, const TraceRequest& request, SurfaceFlux& arriving) {
    arriving.trace.emplace();
    arriving.trace->species = trace(recipe, model, surface, arriving, sticking, request);
    smooth(recipe, surface, arriving);
}

}  // namespace sidewall::app
