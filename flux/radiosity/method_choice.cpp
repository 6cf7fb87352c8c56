// The choice between Monte Carlo and radiosity, and radiosity to an error. Costs are fitted to tests/bench/.
#include "flux/radiosity/method_choice.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flux/radiosity/solver.hpp"
#include "flux/random.hpp"
#include "flux/tracer/trace_checks.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

// CPU time of a gathered ray and its share of the solves, in segments of the tracer: 0.6 to 1 against 0.09 to
// 0.2 microseconds. It is longer (kRayCostOnce) in a program that solves once and touches its memory for the
// first time. kPilotRays: rays of an exchange's pilot.
constexpr double kRayCost = 6.0, kRayCostOnce = 8.0, kPilotRays = 4096.0;
// For surfaces of revolution, which the tracer traces without packets, at 0.25 microseconds a segment: the
// cost of a gathered ray, and of the sky seen by a ring, 25 microseconds an unknown.
constexpr double kRayCostRound = 2.0, kSkyCostRound = 100.0;
// Share of the target error to which Monte Carlo competes on a surface of revolution. Radiosity sees the sky
// of every ring exactly there, so that its error lies deep in the hole. Monte Carlo of the same error is
// noisy on open walls and at the foot of a mask, too: with it the opening of a fluorocarbon contact scatters
// by 7 % between seeds, by 1 % with radiosity.
constexpr double kErrorRound = 0.5;
constexpr double kMargin = 1.1;  // factor on the rays needed, because estimated errors scatter
// Expected error from three halvings of the rays over that from one: a root mean square of three normal
// deviates against the modulus of one, sqrt(4 / 3).
constexpr double kOneHalving = 1.155;
// Least cost assumed for radiosity, in costs of its first rays, which are lost if Monte Carlo wins.
constexpr double kLeastCost = 1.5;
constexpr double kCloser = 200.0;  // relative error asked for over the solver's tolerance

// The solver's tolerance for a relative error of \p target.
double tolerance_to(double target, const SolveOptions& options) {
    return std::clamp(target / kCloser, options.tolerance, std::max(1e-3, options.tolerance));
}

// The statistical error allowed so that together with the elements' error it meets \p target; all of
// \p target if the elements' error comes near to it.
double target_of_rays(double target, const RadiosityFlux& flux, const SolveOptions& options) {
    const double elements = flux.discretisation_error;
    return options.of_rays || elements >= kDiscretisationShare * target
               ? target
               : std::sqrt(target * target - elements * elements);
}

double rays_of_unknown(const Exchange& exchange) {
    return static_cast<double>(exchange.rays()) / static_cast<double>(exchange.unknowns());
}

// Rays an unknown for a statistical error of \p target, extrapolated from \p error at \p rays. The square of
// the error falls as (1 - kFew) / n + kFew / n^2, faster than 1 / n, with n in units of the first rays. In a
// trench and in a deep hole, at stickings of 0.01 and 0.1, it was 0.7 to 1.4 times that up to n = 100.
double rays_needed(double target, double error, double rays) {
    constexpr double kFew = 0.6, kMany = 1.0 - kFew;
    const double n = rays / kFirstRays, few = kFew / (kMany * n + kFew);
    const double left = std::pow(target / error, 2.0);
    const double times = (1.0 - few + std::sqrt((1.0 - few) * (1.0 - few) + 4.0 * left * few)) / (2.0 * left);
    return times > 1.0 ? kMargin * times * rays : rays;
}

using Values = std::vector<double>;

// Importance of rays by adjoint solutions. Let A e = q be the balance of the emission e. If the weight w of a
// ray between a and b changes by the factor 1 + d, a functional z e of the emission changes by
//
//     d w (psi_a - psi_b) (e_b - e_a),      A psi = z,
//
// and for a ray to the source by d w psi_a (source - e_a). To cover the relative errors of all unknowns at
// once, z holds random signs divided by the emission. The mean of the squares over a few such z is the
// contribution of a ray to the variance, which is least if rays start in proportion to its root.
constexpr std::size_t kSigns = 6;    // number of random z: the mean scatters by the root of a sixth
constexpr double kTolerance = 1e-2;  // tolerance of the adjoint solutions
constexpr double kFaintest = 1e-6;   // share of the brightest emission below which less accuracy is needed
constexpr std::uint32_t kSignStream = 0xfffeffffu;  // key of the signs: no species and no gather has it

// The functionals z: random signs divided by the emission.
std::vector<Values> signs_over(const Exchange::State& s, const Values& emitted) {
    double brightest = 0.0;
    for (const double e : emitted) brightest = std::max(brightest, e);
    const RandomKey key = random_key(s.options.seed, s.options.time_step, kSignStream);
    std::vector<Values> rows(kSigns, Values(emitted.size(), 0.0));
    for (std::size_t k = 0; k < kSigns; ++k)
        for (std::size_t i = 0; i < emitted.size(); ++i) {
            const bool up = (draw(key, i, static_cast<std::uint32_t>(k)).word[0] & 1u) != 0;
            const double size = std::max(emitted[i], kFaintest * brightest);
            if (s.profile.unknowns.area[i] > 0.0 && size > 0.0) rows[k][i] = (up ? 1.0 : -1.0) / size;
        }
    return rows;
}

double value_at(const Wedges& w, const Values& x, std::uint32_t triangle, float u, float v) {
    return interpolate(w, x, triangle, static_cast<double>(u), static_cast<double>(v));
}

// Adds the contributions of each triangle's rays to the variance of \p species, as shares of their sum.
void add_variance(const Exchange::State& s, const DiffuseSpecies& species, const RadiosityFlux& flux,
                  const SolveOptions& options, Values& variance) {
    const Solver solver(s, species, options);
    const Wedges& w = s.profile.unknowns;
    Values emitted = by_unknown(s, flux.wedge.flux);
    for (std::size_t i = 0; i < emitted.size(); ++i) emitted[i] *= solver.reemitted()[i];
    const std::vector<Values> responses = solver.respond(signs_over(s, emitted), kTolerance);
    Values own(variance.size(), 0.0);
    for (const SampleGroup& group : s.groups) {
        for (const PairSample& pair : group.pairs) {
            const double change =
                static_cast<double>(pair.weight) * (value_at(w, emitted, pair.b, pair.bu, pair.bv) -
                                                    value_at(w, emitted, pair.a, pair.au, pair.av));
            double squares = 0.0;
            for (const Values& psi : responses)
                squares += std::pow(
                    value_at(w, psi, pair.a, pair.au, pair.av) - value_at(w, psi, pair.b, pair.bu, pair.bv),
                    2.0);
            own[pair.a] += 0.5 * change * change * squares;
            own[pair.b] += 0.5 * change * change * squares;
        }
        const double scale = lobe_scale(species.source_exponent);
        for (const ExitSample& exit : std::span(group.exits).first(s.sky ? 0 : group.exits.size())) {
            const auto cosine = static_cast<double>(exit.cosine);
            const double source =
                cosine > 0.0 ? species.source * scale * lobe(species.source_exponent, cosine) : 0.0;
            const double change =
                static_cast<double>(exit.weight) * (source - value_at(w, emitted, exit.a, exit.au, exit.av));
            double squares = 0.0;
            for (const Values& psi : responses)
                squares += std::pow(value_at(w, psi, exit.a, exit.au, exit.av), 2.0);
            own[exit.a] += change * change * squares;
        }
    }
    double sum = 0.0;
    for (const double v : own) sum += v;
    if (!(sum > 0.0) || !std::isfinite(sum)) return;
    for (std::size_t t = 0; t < own.size(); ++t) variance[t] += own[t] / sum;
}

// Makes further gathers measure the elements' error (residual rays) where slopes of \p fluxes change.
void place_residual_rays(Exchange& exchange, std::span<const RadiosityFlux> fluxes) {
    const Exchange::State& s = exchange.state();
    const TriangleMesh& mesh = s.geometry.mesh;
    Values shares(mesh.triangles.size(), 0.0);
    for (const RadiosityFlux& flux : fluxes) {
        const Values error = errors_of(expected_bends(mesh, s.wedges, flux.wedge.flux));
        double sum = 0.0;
        for (std::size_t t = 0; t < error.size(); ++t) sum += triangle_area(mesh, t) * error[t];
        for (std::size_t t = 0; t < error.size() && sum > 0.0; ++t) shares[t] += error[t] / sum;
    }
    exchange.set_residual_error(shares);
}

// Importance sampling: lets further gathers start rays where they lower the relative errors of all \p fluxes
// most, by adjoint solutions on the rays so far. Traces no ray.
void set_importance(Exchange& exchange, std::span<const DiffuseSpecies> species,
                    std::span<const RadiosityFlux> fluxes, const SolveOptions& options) {
    const Exchange::State& s = exchange.state();
    Values variance(s.geometry.mesh.triangles.size(), 0.0);
    for (std::size_t k = 0; k < species.size(); ++k)
        add_variance(s, species[k], fluxes[k], options, variance);
    exchange.set_start_variance(variance);
    place_residual_rays(exchange, fluxes);
}

}  // namespace

std::string why_not_radiosity(const Species& species) {
    if (species.energy.mean > 0.0) return "its particles have energy";
    if (species.reflection.kind != Reemission::diffuse || species.reflection.to > 0.0)
        return "it is not re-emitted diffusely";
    if (!species.yields.empty() || species.redeposition) return "it has yields";
    if (std::isfinite(species.mean_free_path)) return "its particles collide in the gas";
    if (!species.bins.empty() || species.source_beta != 0.0) return "its source is no cos^n";
    if (species.rotating || !is_untilted(species)) return "its source is tilted";
    return "";
}

std::vector<double> sticking_by_wedge(const Wedges& wedges, std::span<const std::int32_t> materials,
                                      const Species& species) {
    const std::vector<double>& by_material = species.sticking;
    check_sticking(species.name, by_material);
    std::vector<double> sticking(wedges.count(), by_material.front());
    if (by_material.size() == 1 || materials.empty()) return sticking;
    check_materials(species, materials, wedges.corner.size() / 3);
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        sticking[wedges.corner[c]] = by_material[static_cast<std::size_t>(materials[c / 3])];
    return sticking;
}

void gather_for(std::span<const DiffuseSpecies> species, Exchange& exchange, std::uint64_t rays,
                const SolveOptions& options) {
    if (exchange.is_viewed()) return exchange.gather(rays);
    constexpr std::uint64_t kFirstPart = 4;
    const auto left = [&] { return rays > exchange.rays() ? rays - exchange.rays() : 0; };
    if (left() == 0) return;
    if (rays < kFirstPart * exchange.fewest_rays() || left() > exchange.rays_left() ||
        exchange.has_importance())
        return exchange.gather(left());  // too few rays, importance set before, or more than memory holds
    if (exchange.rays() < rays / kFirstPart) exchange.gather(rays / kFirstPart - exchange.rays());
    SolveOptions rough = options;
    rough.errors = rough.unbiased = false;
    rough.tolerance = std::max(1e-3, options.tolerance);
    try {
        std::vector<RadiosityFlux> fluxes;
        for (const DiffuseSpecies& one : species) fluxes.push_back(solve_flux(exchange, one, rough));
        set_importance(exchange, species, fluxes, options);
    } catch (const NumericsError&) {  // a pocket that no ray has left yet: keep starting evenly
    }
    exchange.gather(std::min(left(), exchange.rays_left()));
}

std::vector<RadiosityFlux> solve_fluxes_to(std::span<const double> targets, Exchange& exchange,
                                           std::span<const DiffuseSpecies> species, std::uint64_t most_rays,
                                           const SolveOptions& options) {
    if (targets.size() != species.size())
        throw RecipeError("{} relative errors for {} species: give one each", targets.size(), species.size());
    for (const double target : targets)
        if (!(target > 0.0)) throw RecipeError("relative_error = {}: must be above 0", target);
    if (exchange.rays() == 0)
        exchange.gather(std::min({most_rays, exchange.rays_left(), exchange.fewest_rays()}));
    SolveOptions close = options;
    close.tolerance = tolerance_to(*std::ranges::min_element(targets), options);
    while (true) {
        std::vector<RadiosityFlux> fluxes;
        double worst = 0.0;  // largest ratio of a statistical error to its target
        for (std::size_t k = 0; k < species.size(); ++k) {
            fluxes.push_back(solve_flux(exchange, species[k], close));
            worst = std::max(
                worst, fluxes.back().statistical_error / target_of_rays(targets[k], fluxes.back(), options));
        }
        const std::uint64_t rays = exchange.rays();
        const std::uint64_t left = std::min(most_rays > rays ? most_rays - rays : 0, exchange.rays_left());
        if (worst <= 1.0 || left < rays / 16) return fluxes;
        const double now = rays_of_unknown(exchange);
        const double more = std::clamp(rays_needed(1.0, worst, now) / now - 1.0, 0.25, 3.0);
        try {
            if (!exchange.has_importance() && more == 3.0) set_importance(exchange, species, fluxes, options);
        } catch (const NumericsError&) {
        }
        place_residual_rays(exchange, fluxes);
        exchange.gather(std::min(left, static_cast<std::uint64_t>(more * static_cast<double>(rays)) + 1));
    }
}

MethodChoice choose_method(Exchange& exchange, const Species& species,
                           std::span<const std::int32_t> materials, const TraceOptions& options, bool once) {
    MethodChoice choice;
    if (const std::string why = why_not_radiosity(species); !why.empty()) {
        choice.why_not = why;
        return choice;
    }
    if (exchange.is_viewed()) {
        choice.radiosity = choice.viewed = true;
        return choice;
    }
    const Exchange::State& s = exchange.state();
    const Wedges& wedges = s.wedges;
    TraceOptions pilot = options;
    pilot.rays = std::min<std::uint64_t>(options.rays, 4096 + s.geometry.mesh.triangles.size() / 4);
    pilot.relative_error.reset();
    pilot.progress = nullptr;
    const FluxResult result =
        trace_flux(s.geometry.mesh, s.geometry.scene, s.geometry.box, species, materials, wedges, pilot);
    // Costs follow from errors and segments, which are the same on every machine, and so is the choice.
    const double growth = static_cast<double>(options.rays) / static_cast<double>(result.emitted);
    choice.target = options.relative_error.value_or(result.relative_error / std::sqrt(growth));
    // Rays of the first round of a trace to a relative error.
    const std::uint64_t least = options.relative_error
                                    ? std::min(options.rays, first_round(s.geometry.mesh.triangles.size(),
                                                                         s.geometry.revolution != nullptr))
                                    : 0;
    choice.paths_target = choice.target * (s.geometry.revolution != nullptr ? kErrorRound : 1.0);
    const double more = std::max({1.0, static_cast<double>(least) / static_cast<double>(result.emitted),
                                  std::pow(result.relative_error / choice.paths_target, 2.0)});
    choice.monte_carlo_cost = more * static_cast<double>(result.segments);
    const auto cost = [&](double rays) {
        const bool round = s.geometry.revolution != nullptr;
        const auto unknowns = static_cast<double>(exchange.unknowns());
        return (round  ? kRayCostRound
                : once ? kRayCostOnce
                       : kRayCost) *
                   (rays * unknowns + kPilotRays) +
               (round ? kSkyCostRound * unknowns : 0.0);
    };
    choice.radiosity_cost = kLeastCost * cost(kFirstRays);
    const bool allowed =
        !options.relative_error || exchange.rays() > 0 || exchange.fewest_rays() <= options.rays;
    if (!allowed) choice.radiosity_cost = std::max(choice.radiosity_cost, choice.monte_carlo_cost);
    if (choice.radiosity_cost < choice.monte_carlo_cost) try {
            const std::vector<double> sticking =
                options.sticking_by_wedge.empty()
                    ? sticking_by_wedge(wedges, materials, species)
                    : std::vector<double>(options.sticking_by_wedge.begin(), options.sticking_by_wedge.end());
            const DiffuseSpecies diffuse{
                .name = species.name, .source_exponent = species.source_exponent, .sticking = sticking};
            if (exchange.rays() == 0) exchange.gather(std::min(exchange.fewest_rays(), exchange.rays_left()));
            SolveOptions close{.halvings = 1, .stop = options.stop};
            close.tolerance = tolerance_to(choice.target, close);
            RadiosityFlux first = solve_flux(exchange, diffuse, close);
            choice.guess = std::move(first.wedge.flux);
            const double rays = rays_of_unknown(exchange);
            // For the whole target: the elements' error is mostly noise with so few rays.
            choice.rays = rays_needed(choice.target, kOneHalving * first.statistical_error, rays);
            choice.spent = cost(rays);
            choice.radiosity_cost = cost(choice.rays);
        } catch (const NumericsError&) {  // e.g. a pocket that no ray has left
            choice.radiosity_cost = choice.monte_carlo_cost;
        }
    choice.radiosity = choice.radiosity_cost - choice.spent < choice.monte_carlo_cost;
    return choice;
}

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
