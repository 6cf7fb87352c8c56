#include "flux/radiosity/single_flux.hpp"

#include <algorithm>
#include <utility>

namespace sidewall::flux {

Exchange exchange_of(const SingleFlux& a) {
    return {a.mesh,
            a.scene,
            a.box,
            a.wedges,
            {a.species.source_exponent},
            {.seed = a.options.seed, .progress = a.options.progress, .stop = a.options.stop}};
}

RadiosityFlux solve(const SingleFlux& asked, const MethodChoice& choice, Exchange& exchange) {
    constexpr std::uint64_t kRaysOfUnknown = 64;
    const std::vector<double> sticking = sticking_by_wedge(asked.wedges, asked.materials, asked.species);
    const DiffuseSpecies species{.name = asked.species.name,
                                 .source_exponent = asked.species.source_exponent,
                                 .sticking = sticking,
                                 .guess = choice.guess};
    const SolveOptions options{.of_rays = !asked.options.relative_error, .stop = asked.options.stop};
    if (choice.target > 0.0) {
        const std::uint64_t most = asked.options.relative_error
                                       ? asked.options.rays
                                       : std::max(kMostOfAuto * asked.options.rays, exchange.fewest_rays());
        const double estimated = choice.rays * static_cast<double>(exchange.unknowns());
        const std::uint64_t allowed = std::min(most, exchange.rays() + exchange.rays_left());
        gather_for({&species, 1}, exchange,
                   static_cast<std::uint64_t>(std::min(estimated, static_cast<double>(allowed))), options);
        return std::move(
            solve_fluxes_to({&choice.target, 1}, exchange, {&species, 1}, most, options).front());
    }
    gather_for({&species, 1}, exchange,
               asked.rays_given ? asked.options.rays
                                : std::min(kRaysOfUnknown * exchange.unknowns(), exchange.rays_left()),
               options);
    return solve_flux(exchange, species, options);
}

FoundFlux find_flux(const std::string& method, const SingleFlux& a,
                    const std::function<void(const MethodChoice&)>& chosen) {
    std::optional<Exchange> exchange;
    MethodChoice choice{.radiosity = method == "radiosity", .target = a.options.relative_error.value_or(0.0)};
    if (method != "monte-carlo") exchange.emplace(exchange_of(a));
    FoundFlux found;
    if (method == "auto") {
        found.choice = choice = choose_method(*exchange, a.species, a.materials, a.options, true);
        if (chosen) chosen(choice);
    }
    if (!choice.radiosity) {
        static_cast<FluxResult&>(found) =
            trace_flux(a.mesh, a.scene, a.box, a.species, a.materials, a.wedges, a.options);
        found.escaped_fraction = static_cast<double>(found.escaped) / static_cast<double>(found.emitted);
        return found;
    }
    RadiosityFlux solved = solve(a, choice, *exchange);
    found.radiosity = true;
    found.emitted = exchange->rays();
    found.absorbed = static_cast<std::uint64_t>(solved.absorbed * static_cast<double>(found.emitted) + 0.5);
    found.escaped = found.emitted - found.absorbed;
    found.escaped_fraction = solved.escaped;
    found.leaked = exchange->leaked();
    found.segments = exchange->segments();
    found.seconds = exchange->seconds() + solved.seconds;
    found.solve_seconds = solved.seconds;
    found.unknowns = exchange->unknowns();
    found.samples = exchange->samples();
    found.residual_rays = exchange->residual_rays();
    found.iterations = solved.iterations;
    found.relative_error = solved.relative_error;
    found.statistical_error = solved.statistical_error;
    found.discretisation_error = solved.discretisation_error;
    static_cast<TallyFlux&>(found) = std::move(solved);
    return found;
}

}  // namespace sidewall::flux
