#include "app/process/arriving/flux_methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/process/arriving/radiosity_fluxes.hpp"
#include "app/process/arriving/species_flux.hpp"
#include "app/recipe/step_model.hpp"
#include "flux/radiosity/method_choice.hpp"

namespace sidewall::app {
namespace {

// Number of Monte Carlo traces a time step; radiosity gathers rays only once.
double traces_of(const Model& model) {
    return model.sticking && model.coverages.pulse > 0.0 ? model.coverages.parts : 1.0;
}

std::vector<flux::MethodChoice> choices_of(const Recipe& recipe, const Model& model,
                                           const TracedSurface& surface, const SurfaceFlux& arriving,
                                           std::span<const double> sticking, const TraceRequest& request) {
    const std::size_t wedges = arriving.wedges.count();
    std::vector<flux::MethodChoice> choices;
    for (std::size_t k = 0; k < model.species.size(); ++k) {
        if (std::string why = why_monte_carlo(model, k); !why.empty()) {
            choices.emplace_back().why_not = std::move(why);
            continue;
        }
        flux::TraceOptions options = trace_options(recipe, request);
        options.progress = nullptr;
        options.batches = std::min(options.batches, flux::TraceOptions().batches);  // enough for few rays
        options.species_index = static_cast<std::uint32_t>(k);
        if (!sticking.empty()) options.sticking_by_wedge = sticking.subspan(k * wedges, wedges);
        flux::ExchangeOptions of_exchange = exchange_options(recipe, request);
        of_exchange.progress = nullptr;
        flux::Exchange exchange(surface.flight_mesh(), *surface.scene, surface.box, arriving.wedges,
                                {model.species[k].source_exponent}, std::move(of_exchange));
        choices.push_back(flux::choose_method(exchange, model.species[k], arriving.materials, options));
    }
    return choices;
}

using Passes = std::vector<std::vector<std::size_t>>;  // of indices of species

// Cost of a time step if radiosity takes the species that cost it at most \p most. The rays for the most
// demanding of these serve all; so do the paths for the most expensive species of a pass.
double cost(const Model& model, const Passes& passes, const std::vector<flux::MethodChoice>& choices,
            double most) {
    double rays = 0.0, paths = 0.0;
    for (const std::vector<std::size_t>& pass : passes) {
        double longest = 0.0;
        for (const std::size_t k : pass) {
            const flux::MethodChoice& choice = choices[k];
            const bool solved = choice.why_not.empty() && choice.radiosity_cost <= most;
            (solved ? rays : longest) =
                std::max(solved ? rays : longest, solved ? choice.radiosity_cost : choice.monte_carlo_cost);
        }
        paths += longest;
    }
    return rays + traces_of(model) * paths;
}

std::vector<SpeciesMethod> cheapest(const Model& model, const std::vector<flux::MethodChoice>& choices) {
    constexpr double kNone = -1.0;
    const Passes passes = flux::passes_of(model.species);
    double best = kNone;
    for (const flux::MethodChoice& choice : choices)
        if (choice.why_not.empty() &&
            cost(model, passes, choices, choice.radiosity_cost) < cost(model, passes, choices, best))
            best = choice.radiosity_cost;
    // All solved species share one exchange. If it has no noise for some (viewed), radiosity takes only
    // those.
    const bool any_viewed = std::ranges::any_of(choices, &flux::MethodChoice::viewed);
    std::vector<SpeciesMethod> methods;
    for (std::size_t k = 0; k < choices.size(); ++k) {
        const flux::MethodChoice& choice = choices[k];
        const double ratio =
            choice.radiosity_cost / std::max(1.0, traces_of(model) * choice.monte_carlo_cost);
        const bool possible = choice.why_not.empty(),
                   solved = possible && (any_viewed ? choice.viewed : choice.radiosity_cost <= best);
        methods.push_back({model.species[k].name, solved,
                           choice.viewed ? "a profile's exchange has no noise"
                           : possible
                               ? fmt::format("radiosity costs about {:.2g} times as much as its paths at "
                                             "a relative error of {:.2g}",
                                             ratio, choice.paths_target)
                               : choice.why_not,
                           choice.target, solved ? choice.rays : 0.0});
    }
    return methods;
}

}  // namespace

std::vector<SpeciesMethod> choose_methods(const Recipe& recipe, const Model& model,
                                          const TracedSurface& surface, const SurfaceFlux& arriving,
                                          std::span<const double> sticking, const TraceRequest& request) {
    if (recipe.flux.method == "auto")
        return cheapest(model, choices_of(recipe, model, surface, arriving, sticking, request));
    const bool asked = recipe.flux.method == "radiosity";
    std::vector<SpeciesMethod> methods;
    for (std::size_t k = 0; k < model.species.size(); ++k) {
        const std::string why_not = asked ? why_monte_carlo(model, k) : "";
        methods.push_back({model.species[k].name, asked && why_not.empty(), why_not, 0.0, 0.0});
    }
    return methods;
}

std::string describe(const std::vector<SpeciesMethod>& methods) {
    std::string text;
    for (const SpeciesMethod& method : methods) {
        text += fmt::format("{}{} by {}", text.empty() ? "" : "; ", method.species, method_name(method));
        if (!method.reason.empty()) text += fmt::format(" ({})", method.reason);
    }
    return text;
}

bool are_of(const Model& model, const std::vector<SpeciesMethod>& methods) {
    return std::ranges::equal(model.species, methods, {}, &flux::Species::name, &SpeciesMethod::species);
}

const char* method_name(const SpeciesMethod& method) {
    return method.radiosity ? "radiosity" : "monte-carlo";
}

}  // namespace sidewall::app
