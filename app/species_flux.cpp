#include "app/species_flux.hpp"

#include <fmt/format.h>

#include "app/output.hpp"
#include "flux/averaging.hpp"
#include "flux/leaks.hpp"
#include "flux/smoothing.hpp"

namespace sidewall::app {
namespace {

// Single leaks are rounding where two sheets touch; they must not end a run of few rays.
constexpr double kSingleLeaks = 10.0;

// Complains of a surface with holes and of noise.
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
std::vector<flux::FluxResult> trace(const Recipe& recipe, const Model& model,
                                    std::span<const double> sticking, const SurfaceFlux& surface,
                                    std::uint32_t time_step, const std::function<void(double)>& progress) {
    flux::TraceOptions options;
    options.rays =
        static_cast<std::uint64_t>(recipe.flux.relative_error ? recipe.flux.max_rays : recipe.flux.rays);
    options.batches = static_cast<std::uint32_t>(recipe.flux.batches);
    options.seed = static_cast<std::uint64_t>(recipe.flux.seed);
    options.time_step = time_step;
    options.sticking_by_wedge = sticking;
    options.progress = progress;
    options.stop = interrupted;
    const auto traced = [&](auto&& tracer) {
        return tracer(surface.traced(), *surface.scene, surface.box, model.species, surface.materials,
                      surface.wedges, options);
    };
    std::vector<flux::FluxResult> results =
        recipe.flux.relative_error ? traced([&](auto&&... parts) {
            return flux::trace_fluxes_to(*recipe.flux.relative_error, parts...);
        })
                                   : traced([](auto&&... parts) { return flux::trace_fluxes(parts...); });
    for (std::size_t k = 0; k < results.size(); ++k)
        check_trace(recipe, model.species[k], results[k], time_step);
    return results;
}

// Arrivals that would make as much flux with weight 1 each. A species that rides on with those that stick
// less has many more, of little weight.
std::uint64_t whole_arrivals(const SurfaceFlux& surface, const flux::FluxResult& result) {
    if (result.pass_species == 1) return result.arrivals;
    double sum = 0.0;
    for (std::size_t w = 0; w < surface.wedges.count(); ++w)
        sum += surface.wedges.area[w] * result.wedge.flux[w];
    return static_cast<std::uint64_t>(sum * static_cast<double>(result.emitted) / surface.box.area() + 0.5);
}

// The fluxes that models see, from those counted.
void take_tallies(const Recipe& recipe, SurfaceFlux& surface) {
    surface.wedge_flux.clear();
    surface.wedge_error.clear();
    std::vector<const flux::TallyFlux*> tallies;
    for (const flux::FluxResult& result : surface.fluxes)
        for (std::size_t k = 0; k <= result.others.size(); ++k) {
            tallies.push_back(&result.tally(k));
            surface.wedge_flux.push_back(flux::smoothed_flux(
                surface.traced(), surface.wedges, result.tally(k).wedge, whole_arrivals(surface, result)));
            surface.wedge_error.push_back(result.tally(k).wedge.error);
        }
    if (recipe.flux.averaging == 0.0) return;
    std::vector<flux::Unaveraged> fluxes;
    for (std::size_t k = 0; k < tallies.size(); ++k)
        fluxes.push_back({surface.wedge_flux[k], tallies[k]->triangle.error});
    std::vector<flux::FluxField> averages = flux::averaged(surface.traced(), surface.box, surface.wedges,
                                                           surface.materials, fluxes, recipe.flux.averaging);
    for (std::size_t k = 0; k < tallies.size(); ++k) {
        surface.wedge_flux[k] = std::move(averages[k].flux);
        surface.wedge_error[k] = std::move(averages[k].error);
    }
}

}  // namespace

void trace_species(const Recipe& recipe, const Model& model, std::span<const double> sticking,
                   std::uint32_t time_step, const std::function<void(double)>& progress,
                   SurfaceFlux& surface) {
    surface.fluxes = trace(recipe, model, sticking, surface, time_step, progress);
    take_tallies(recipe, surface);
}

}  // namespace sidewall::app
