#include "app/process/arriving/species_flux.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "app/process/arriving/radiosity_fluxes.hpp"
#include "flux/open_shares.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "flux/revolution.hpp"
#include "flux/tracer/smoothing.hpp"

namespace sidewall::app {
namespace {

// Leaks allowed besides flux::kRoundingLeaks. Single leaks are rounding where two sheets touch, and must not
// end a run of few rays. It is as many as kRoundingLeaks allows in a million rays, the default of a species.
constexpr double kSingleLeaks = 10.0;

// Advice on how to lower a relative error above the target.
std::string remedy(const Recipe& recipe, const flux::FluxResult& result, const SpeciesMethod& method) {
    if (result.discretisation_error > flux::kDiscretisationShare * *recipe.flux.relative_error)
        return fmt::format(
            "{:.3g} of it are the traced mesh's linear elements, so make grid_spacing or "
            "simplify.l_max smaller",
            result.discretisation_error);
    return method.radiosity ? "allow more flux.max_rays and flux.memory" : "allow more flux.max_rays";
}

// A warning if the noise of a result exceeds its target; else empty.
std::string noise_warning(const Recipe& recipe, const flux::FluxResult& result, const SpeciesMethod& method,
                          std::uint32_t time_step) {
    constexpr double kMissed = 1.25;  // ratio to auto's expectation; less is scatter
    if (recipe.flux.relative_error && !(result.largest_error() <= *recipe.flux.relative_error))
        return fmt::format(
            "time step {}: species {}: relative error {:.3g} after {} rays, above the {:.3g} asked "
            "for: {} or ask for less",
            time_step, method.species, result.largest_error(), result.emitted, *recipe.flux.relative_error,
            remedy(recipe, result, method));
    const double statistical = std::sqrt(
        std::max(0.0, std::pow(result.relative_error, 2.0) - std::pow(result.discretisation_error, 2.0)));
    if (!method.radiosity || !(method.target > 0.0) || !(statistical > kMissed * method.target)) return {};
    return fmt::format(
        "time step {}: species {}: radiosity's relative error is {:.3g} after {} rays, above the {:.3g} of "
        "{} paths, at which auto compared the two: allow more flux.memory or use monte-carlo",
        time_step, method.species, statistical, result.emitted, method.target, recipe.flux.rays);
}

// Refuses a surface with holes, and warns of noise above the target.
void check_trace(const Recipe& recipe, const flux::Species& species, const flux::FluxResult& result,
                 const SpeciesMethod& method, const TraceRequest& request) {
    if (result.others.size() + 1 != flux::tally_count(species))
        throw NumericsError(fmt::format("species {}: the tracer did not count its yields", species.name));
    if (flux::leaks_too_much(result.leaked, result.emitted, kSingleLeaks))
        throw LeakError(fmt::format(
            "species {}: {} of {} particles leaked through the surface; use a smaller grid_spacing or a "
            "milder simplification",
            species.name, result.leaked, result.emitted));
    if (!request.warn || request.noise) return;  // with [flux] accuracy, summary.json reports the noise
    if (const std::string text = noise_warning(recipe, result, method, request.key); !text.empty())
        request.warn(text);
}

// Whether the values (sticking or emission) of all species of a pass are those of the trace before. If both
// are, so are the paths.
bool unchanged(const std::vector<std::size_t>& pass, std::span<const double> before,
               std::span<const double> now, std::size_t wedges) {
    return before.size() == now.size() && std::ranges::all_of(pass, [&](std::size_t k) {
               return now.empty() ||
                      std::ranges::equal(before.subspan(k * wedges, wedges), now.subspan(k * wedges, wedges));
           });
}

// Whether a species' direct flux is kept apart as a function of the normal. Averaged fluxes have no normal.
bool has_direct(const Recipe& recipe, const Model& model, std::size_t species) {
    return recipe.flux.averaging == 0.0 && species < model.direct.size() && model.direct[species];
}

// Traces one pass. Its random numbers are keyed by the index of its first species.
void trace_pass(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                const std::vector<std::size_t>& pass, std::span<const double> sticking,
                std::span<const double> emission, const TraceRequest& request, SurfaceFlux& arriving) {
    const std::size_t wedges = arriving.wedges.count();
    std::vector<flux::Species> species;
    std::vector<double> by_wedge;
    for (const std::size_t k : pass) {
        species.push_back(model.species[k]);
        if (sticking.empty()) continue;
        const auto own = sticking.subspan(k * wedges, wedges);
        by_wedge.insert(by_wedge.end(), own.begin(), own.end());
    }
    flux::TraceOptions options = trace_options(recipe, request);
    options.species_index = static_cast<std::uint32_t>(pass.front());
    options.sticking_by_wedge = by_wedge;
    // A species that desorbs is alone in its pass.
    if (species.front().desorbs && !emission.empty())
        options.emission_by_wedge = emission.subspan(pass.front() * wedges, wedges);
    options.reflected = pass.size() == 1 && has_direct(recipe, model, pass.front());
    options.adjoint = options.adjoint && !options.reflected;  // it samples first arrivals, known here
    std::vector<flux::FluxResult> results =
        flux::trace_fluxes(surface.flight_mesh(), *surface.scene, surface.box, species, arriving.materials,
                           arriving.wedges, options);
    for (std::size_t i = 0; i < pass.size(); ++i) arriving.trace->species[pass[i]] = std::move(results[i]);
}

// The request of one part of a trace, with progress scaled to all parts.
TraceRequest part_of(const TraceRequest& request, std::size_t part, std::size_t parts) {
    TraceRequest own = request;
    if (request.progress)
        own.progress = [report = request.progress, part, parts](double done) {
            report((static_cast<double>(part) + done) / static_cast<double>(parts));
        };
    return own;
}

// Traces or solves every species by its method.
void trace_by_methods(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                      std::span<const double> sticking, std::span<const double> emission,
                      const TraceRequest& request, std::optional<TraceReport> before, SharedTraces& shared,
                      SurfaceFlux& arriving) {
    const std::vector<std::vector<std::size_t>>& passes = shared.passes;
    const bool any_solved = std::ranges::any_of(shared.methods, &SpeciesMethod::radiosity);
    const std::size_t parts = passes.size() + (any_solved ? 1 : 0);
    for (std::size_t p = 0; p < passes.size(); ++p) {
        if (!before || !unchanged(passes[p], shared.sticking, sticking, arriving.wedges.count()) ||
            !unchanged(passes[p], shared.emission, emission, arriving.wedges.count()))
            trace_pass(recipe, model, surface, passes[p], sticking, emission, part_of(request, p, parts),
                       arriving);
        else
            for (const std::size_t k : passes[p]) arriving.trace->species[k] = std::move(before->species[k]);
    }
    if (any_solved)
        solve_species(recipe, model, surface, sticking, emission, part_of(request, passes.size(), parts),
                      shared.exchange, before, arriving);
    for (std::size_t k = 0; k < model.species.size(); ++k)
        check_trace(recipe, model.species[k], arriving.trace->species[k], shared.methods[k], request);
}

// Number of hits of weight 1 that would make as much flux, for smoothing. A species traced on the paths of
// one that sticks less hits far more often, with small weights. Adjoint paths start on every element, so all
// errors are known: no limit.
std::uint64_t whole_arrivals(const flux::LateralBox& box, const flux::Wedges& wedges,
                             const flux::FluxResult& result) {
    if (result.adjoint) return std::numeric_limits<std::uint64_t>::max();
    if (result.pass_species == 1) return result.arrivals;
    double sum = 0.0;
    for (std::size_t w = 0; w < wedges.count(); ++w) sum += wedges.area[w] * result.wedge.flux[w];
    return static_cast<std::uint64_t>(sum * static_cast<double>(result.emitted) / box.area() + 0.5);
}

// The direct fluxes of the model's species, without the rest, which is not known yet.
std::vector<DirectPart> direct_parts(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                                     const flux::Wedges& wedges) {
    std::vector<DirectPart> parts;
    std::size_t tally = 0;
    for (std::size_t k = 0; k < model.species.size(); tally += flux::tally_count(model.species[k]), ++k)
        if (has_direct(recipe, model, k))
            parts.push_back({model.direct[k],
                             tally,
                             flux::open_shares(*model.direct[k], surface.flight_mesh(), *surface.scene,
                                               surface.box, wedges, surface.simplified.has_value()),
                             {}});
    return parts;
}

// Sets the fluxes that models see to the direct fluxes, which have no noise, plus the rest.
void join_parts(const TracedSurface& surface, SurfaceFlux& arriving) {
    if (arriving.direct.empty()) return;
    const std::vector<Vec3> normals = flux::wedge_normals(surface.flight_mesh(), arriving.wedges);
    const std::vector<std::int32_t> materials = flux::wedge_materials(arriving.wedges, arriving.materials);
    for (DirectPart& part : arriving.direct) {
        const std::size_t tallies = part.source->tallies();
        const auto first = arriving.flux.begin() + static_cast<std::ptrdiff_t>(part.tally);
        part.rest.assign(first, first + static_cast<std::ptrdiff_t>(tallies));
        std::vector<double> open(part.open.size()), flux(tallies);
        for (std::size_t w = 0; w < normals.size(); ++w) {
            for (std::size_t b = 0; b < open.size(); ++b) open[b] = part.open[b][w];
            for (std::size_t k = 0; k < tallies; ++k) flux[k] = part.rest[k][w];
            part.source->add(normals[w], static_cast<std::size_t>(materials[w]), open, flux);
            for (std::size_t k = 0; k < tallies; ++k) arriving.flux[part.tally + k][w] = flux[k];
        }
    }
}

// Averages the fluxes that models see within [flux] averaging.
void average(const Recipe& recipe, const TracedSurface& surface,
             const std::vector<const flux::TallyFlux*>& tallies, const std::vector<std::uint8_t>& solved,
             SurfaceFlux& arriving) {
    std::vector<flux::Unaveraged> fluxes;
    for (std::size_t k = 0; k < tallies.size(); ++k)
        fluxes.push_back({arriving.flux[k], tallies[k]->triangle.error});
    std::vector<flux::FluxField> averages =
        flux::averaged(surface.flight_mesh(), surface.box, arriving.wedges, arriving.materials, fluxes,
                       recipe.flux.averaging);
    for (std::size_t k = 0; k < tallies.size(); ++k) {
        arriving.flux[k] = std::move(averages[k].flux);
        if (solved[k] == 0) arriving.trace->error[k] = std::move(averages[k].error);
    }
}

// Sets the fluxes that models see. Only traced fluxes are smoothed: a solved one has no counted hits, and its
// errors are correlated with its neighbours'.
void smooth(const Recipe& recipe, const Model& model, const TracedSurface& surface, SurfaceFlux& arriving) {
    constexpr double kBroad = 2.0;  // largest n of cos^n sources whose flux is a parabola about the axis
    TraceReport& trace = *arriving.trace;
    arriving.flux.clear();
    std::vector<const flux::TallyFlux*> tallies;
    std::vector<std::uint8_t> solved;
    for (std::size_t s = 0; s < trace.species.size(); ++s) {
        const flux::FluxResult& result = trace.species[s];
        for (std::size_t k = 0; k <= result.others.size(); ++k) {
            const flux::FluxField& wedge =
                k < result.reflected.size() ? result.reflected[k].wedge : result.tally(k).wedge;
            tallies.push_back(&result.tally(k));
            solved.push_back(trace.methods[s].radiosity ? 1 : 0);
            arriving.flux.push_back(
                solved.back() != 0
                    ? wedge.flux
                    : flux::smoothed_flux(surface.flight_mesh(), arriving.wedges, wedge,
                                          whole_arrivals(surface.box, arriving.wedges, result)));
            const bool broad = model.species[s].bins.empty() && model.species[s].source_exponent <= kBroad;
            if (surface.sector && solved.back() == 0 && broad)
                flux::smooth_about_axis(*surface.sector, arriving.wedges, wedge, arriving.flux.back());
            trace.error.push_back(wedge.error);
        }
    }
    if (recipe.flux.averaging > 0.0)
        average(recipe, surface, tallies, solved, arriving);
    else
        join_parts(surface, arriving);
}

// Passes of the species that Monte Carlo traces, as their indices in the model.
std::vector<std::vector<std::size_t>> traced_passes(const Model& model,
                                                    const std::vector<SpeciesMethod>& methods) {
    std::vector<std::size_t> places;
    std::vector<flux::Species> species;
    for (std::size_t k = 0; k < methods.size(); ++k)
        if (!methods[k].radiosity) {
            places.push_back(k);
            species.push_back(model.species[k]);
        }
    std::vector<std::vector<std::size_t>> passes = flux::passes_of(species);
    for (auto& pass : passes)
        for (std::size_t& k : pass) k = places[k];
    return passes;
}

}  // namespace

void add_direct_parts(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                      SurfaceFlux& arriving) {
    arriving.direct = direct_parts(recipe, model, surface, arriving.wedges);
    join_parts(surface, arriving);
}

SharedTraces shared_traces(const Model& model, std::vector<SpeciesMethod> methods) {
    std::vector<std::vector<std::size_t>> passes = traced_passes(model, methods);
    return {std::move(methods), std::move(passes)};
}

void trace_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, SharedTraces& shared, SurfaceFlux& arriving) {
    std::optional<TraceReport> before = std::exchange(arriving.trace, TraceReport{});
    if (arriving.direct.empty()) arriving.direct = direct_parts(recipe, model, surface, arriving.wedges);
    arriving.trace->methods = shared.methods;
    arriving.trace->species.resize(model.species.size());
    trace_by_methods(recipe, model, surface, sticking, emission, request, std::move(before), shared,
                     arriving);
    shared.sticking.assign(sticking.begin(), sticking.end());
    shared.emission.assign(emission.begin(), emission.end());
    smooth(recipe, model, surface, arriving);
}

flux::TraceOptions trace_options(const Recipe& recipe, const TraceRequest& request) {
    flux::TraceOptions options;
    options.rays = static_cast<std::uint64_t>(recipe.flux.most_rays());
    options.relative_error = request.noise ? request.noise : recipe.flux.relative_error;
    options.batches = static_cast<std::uint32_t>(recipe.flux.batches);
    options.seed = static_cast<std::uint64_t>(recipe.flux.seed);
    options.time_step = request.key;
    options.progress = request.progress;
    options.stop = request.stop;
    options.shares = request.shares;
    options.adjoint = recipe.flux.method == "auto";
    return options;
}

}  // namespace sidewall::app
