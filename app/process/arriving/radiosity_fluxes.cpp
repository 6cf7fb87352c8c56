#include "app/process/arriving/radiosity_fluxes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "flux/radiosity/method_choice.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

constexpr double kBytesPerGigabyte = 1e9;

// Source exponents of the species that radiosity takes, each once.
std::vector<double> exponents_of(const Model& model, const std::vector<SpeciesMethod>& methods) {
    std::vector<double> exponents;
    for (std::size_t k = 0; k < methods.size(); ++k)
        if (methods[k].radiosity) exponents.push_back(model.species[k].source_exponent);
    std::sort(exponents.begin(), exponents.end());
    exponents.erase(std::unique(exponents.begin(), exponents.end()), exponents.end());
    return exponents;
}

flux::Exchange make_exchange(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                             const TraceRequest& request, const SurfaceFlux& arriving) {
    return {surface.flight_mesh(),
            *surface.scene,
            surface.box,
            arriving.wedges,
            exponents_of(model, arriving.trace->methods),
            exchange_options(recipe, request)};
}

// Most rays that radiosity may gather.
std::uint64_t most_rays(const FluxSection& flux) {
    const auto rays = static_cast<std::uint64_t>(flux.most_rays());
    return flux.method == "auto" && !flux.relative_error ? flux::kMostOfAuto * rays : rays;
}

// Solves for all species at once, so that they share the gathered rays.
// \param targets  relative errors; 0: that of [flux] rays.
// \param first    rays an unknown to begin with; 0: as few as an error estimate needs.
std::vector<flux::RadiosityFlux> solve(const Recipe& recipe, std::span<const flux::DiffuseSpecies> species,
                                       std::span<const double> targets, double first,
                                       flux::Exchange& exchange, const TraceRequest& request) {
    flux::SolveOptions options;
    options.stop = request.stop;
    options.errors = request.errors;
    options.of_rays = !recipe.flux.relative_error;  // auto's targets are statistical errors
    if (std::ranges::any_of(targets, [](double target) { return target > 0.0; })) {
        std::vector<double> bounds(targets.begin(), targets.end());
        std::ranges::replace(bounds, 0.0, kInfinity);
        const std::uint64_t fewest = recipe.flux.relative_error ? 0 : exchange.fewest_rays();
        const std::uint64_t most = std::max(most_rays(recipe.flux), fewest);
        const auto begin = static_cast<std::uint64_t>(
            std::min(first * static_cast<double>(exchange.unknowns()), static_cast<double>(most)));
        if (exchange.rays() == 0 && begin > 0)
            flux::gather_for(species, exchange, std::min(begin, exchange.rays_left()), options);
        return flux::solve_fluxes_to(bounds, exchange, species, most, options);
    }
    if (exchange.rays() == 0)
        flux::gather_for(species, exchange, std::min(most_rays(recipe.flux), exchange.rays_left()), options);
    std::vector<flux::RadiosityFlux> fluxes;
    for (const flux::DiffuseSpecies& one : species)
        fluxes.push_back(flux::solve_flux(exchange, one, options));
    return fluxes;
}

flux::FluxResult as_result(flux::RadiosityFlux&& flux, const flux::Exchange& exchange, std::size_t species,
                           std::size_t place) {
    flux::FluxResult result;
    static_cast<flux::TallyFlux&>(result) = std::move(static_cast<flux::TallyFlux&>(flux));
    result.emitted = exchange.rays();
    result.segments = exchange.segments();
    result.leaked = place == 0 ? exchange.leaked() : 0;
    result.relative_error = flux.relative_error;
    result.discretisation_error = flux.discretisation_error;
    result.seconds = exchange.seconds();
    result.pass_species = static_cast<std::uint32_t>(species);
    result.pass_place = static_cast<std::uint32_t>(place);
    return result;
}

}  // namespace

void solve_species(const Recipe& recipe, const Model& model, const TracedSurface& surface,
                   std::span<const double> sticking, std::span<const double> emission,
                   const TraceRequest& request, std::optional<flux::Exchange>& exchange,
                   const std::optional<TraceReport>& before, SurfaceFlux& arriving) {
    TraceReport& trace = *arriving.trace;
    const std::size_t wedges = arriving.wedges.count();
    std::vector<std::size_t> places;
    for (std::size_t k = 0; k < trace.methods.size(); ++k)
        if (trace.methods[k].radiosity) places.push_back(k);

    std::vector<std::vector<double>> own(places.size());  // sticking that no coverage affects
    std::vector<flux::DiffuseSpecies> species(places.size());
    std::vector<double> targets;
    double first = 0.0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        const flux::Species& one = model.species[places[i]];
        species[i].name = one.name;
        targets.push_back(
            request.noise.value_or(recipe.flux.relative_error.value_or(trace.methods[places[i]].target)));
        first = std::max(first, trace.methods[places[i]].rays);
        species[i].source_exponent = one.source_exponent;
        if (sticking.empty()) own[i] = flux::sticking_by_wedge(arriving.wedges, arriving.materials, one);
        species[i].sticking =
            sticking.empty() ? std::span<const double>(own[i]) : sticking.subspan(places[i] * wedges, wedges);
        if (one.desorbs && !emission.empty())
            species[i].emission = emission.subspan(places[i] * wedges, wedges);
        if (before) species[i].guess = before->species[places[i]].wedge.flux;
    }
    if (!exchange) exchange.emplace(make_exchange(recipe, model, surface, request, arriving));
    std::vector<flux::RadiosityFlux> fluxes;
    try {
        fluxes = solve(recipe, species, targets, first, *exchange, request);
    } catch (const NumericsError& error) {
        if (flux::leaks_too_much(exchange->leaked(), exchange->rays())) throw LeakError(error.what());
        throw;
    }
    for (std::size_t i = 0; i < places.size(); ++i)
        trace.species[places[i]] = as_result(std::move(fluxes[i]), *exchange, places.size(), i);
}

flux::ExchangeOptions exchange_options(const Recipe& recipe, const TraceRequest& request) {
    return {.seed = static_cast<std::uint64_t>(recipe.flux.seed),
            .time_step = request.key,
            .most_bytes = static_cast<std::uint64_t>(recipe.flux.memory * kBytesPerGigabyte),
            .progress = request.progress,
            .stop = request.stop,
            .shares = request.shares};
}

double radiosity_memory(const FluxSection& flux) {
    if (flux.method == "monte-carlo") return 0.0;
    return std::min(flux.memory * kBytesPerGigabyte,
                    static_cast<double>(flux::exchange_bytes(most_rays(flux))));
}

}  // namespace sidewall::app
