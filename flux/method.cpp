// Which method a species takes, and what radiosity asks of it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "flux/radiosity.hpp"
#include "flux/strip.hpp"
#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

// CPU time of a gathered ray and its share of the solves, in segments of the tracer's: 0.6 to 1 against 0.15
// to 0.2 microseconds. And rays of an exchange's pilot.
constexpr double kRayCost = 5.0, kPilotRays = 4096.0;
constexpr double kFirstRays = 12.0;  // an unknown: with fewer, halves of the rays tell no errors
constexpr double kMargin = 1.1;      // rays more than errors ask for, which scatter
constexpr double kCloser = 200.0;    // the solver's tolerance than the error asked for

// Rays an unknown that \p species takes to a relative error of \p target, from what the first ones show of
// it.
double rays_needed(double target, const TriangleMesh& mesh, const surface::RayScene& scene,
                   const LateralBox& box, const Wedges& wedges, const DiffuseSpecies& species,
                   const TraceOptions& options) {
    Exchange first(mesh, scene, box, wedges, {species.source_exponent},
                   {.seed = options.seed,
                    .time_step = options.time_step,
                    .stop = options.stop,
                    .shares = options.shares});
    first.gather(std::min(first.fewest_rays(), first.rays_left()));
    const double error = solve_flux(first, species, {.tolerance = target / kCloser}).statistical_error;
    // Errors of few rays fall faster than their square root.
    constexpr double kFall = 0.6;
    return kFirstRays * std::max(1.0, kMargin * std::pow(error / target, 1.0 / kFall));
}

// The statistical error that leaves \p target of both, or, where hardly any would, that target.
double target_of_rays(double target, double discretisation) {
    return discretisation < kElementsAlone * target
               ? std::sqrt(target * target - discretisation * discretisation)
               : target;
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
    if (by_material.empty())
        throw RecipeError(
            fmt::format("{}: no sticking probability: give one, or one a material", species.name));
    for (const double s : by_material)
        if (!(s >= 0.0 && s <= 1.0))
            throw RecipeError(fmt::format("{}: sticking = {}: must be in [0, 1]", species.name, s));
    std::vector<double> sticking(wedges.count(), by_material.front());
    if (by_material.size() == 1 || materials.empty()) return sticking;
    if (3 * materials.size() != wedges.corner.size())
        throw GeometryError(fmt::format("{} materials for {} triangles: give one a triangle",
                                        materials.size(), wedges.corner.size() / 3));
    for (std::size_t t = 0; t < materials.size(); ++t) {
        const auto id = static_cast<std::size_t>(materials[t]);
        if (materials[t] < 0 || id >= by_material.size())
            throw RecipeError(
                fmt::format("{}: triangle {} is of material {}, which has no sticking probability",
                            species.name, t, materials[t]));
        for (std::size_t k = 0; k < 3; ++k) sticking[wedges.corner[3 * t + k]] = by_material[id];
    }
    return sticking;
}

std::uint64_t Exchange::fewest_rays() const {
    return static_cast<std::uint64_t>(kFirstRays) * unknowns();
}

void gather_for(std::span<const DiffuseSpecies> species, Exchange& exchange, std::uint64_t rays,
                const SolveOptions& options) {
    constexpr std::uint64_t kFirstPart = 4;
    if (rays < kFirstPart * exchange.fewest_rays() || rays > exchange.rays_left() || exchange.is_focused())
        return exchange.gather(rays);  // too few to tell, or refused
    const std::uint64_t first = rays / kFirstPart;
    exchange.gather(first);
    SolveOptions rough = options;
    rough.errors = rough.unbiased = false;
    rough.tolerance = std::max(1e-3, options.tolerance);
    try {
        std::vector<RadiosityFlux> fluxes;
        for (const DiffuseSpecies& one : species) fluxes.push_back(solve_flux(exchange, one, rough));
        focus(exchange, species, fluxes, options);
    } catch (const NumericsError&) {  // so few rays may leave a pocket without a way out: even starts will do
    }
    exchange.gather(std::min(rays - first, exchange.rays_left()));
}

std::vector<RadiosityFlux> solve_fluxes_to(std::span<const double> targets, Exchange& exchange,
                                           std::span<const DiffuseSpecies> species, std::uint64_t most_rays,
                                           const SolveOptions& options) {
    if (targets.size() != species.size())
        throw RecipeError(
            fmt::format("{} relative errors for {} species: give one each", targets.size(), species.size()));
    for (const double target : targets)
        if (!(target > 0.0)) throw RecipeError(fmt::format("relative_error = {}: must be above 0", target));
    if (exchange.rays() == 0)
        exchange.gather(std::min({most_rays, exchange.rays_left(), exchange.fewest_rays()}));
    SolveOptions close = options;  // to the errors asked for
    close.tolerance = std::clamp(*std::ranges::min_element(targets) / kCloser, options.tolerance,
                                 std::max(1e-3, options.tolerance));
    while (true) {
        std::vector<RadiosityFlux> fluxes;
        double worst = 0.0;  // of what was asked
        for (std::size_t k = 0; k < species.size(); ++k) {
            fluxes.push_back(solve_flux(exchange, species[k], close));
            const double bound =
                options.of_rays ? targets[k] : target_of_rays(targets[k], fluxes.back().discretisation_error);
            worst = std::max(worst, fluxes.back().statistical_error / bound);
        }
        const std::uint64_t rays = exchange.rays();
        const std::uint64_t left = std::min(most_rays > rays ? most_rays - rays : 0, exchange.rays_left());
        if (worst <= 1.0 || left < rays / 16) return fluxes;
        // Errors of few rays fall faster than their square root: do not leap too far.
        const double more = std::clamp(kMargin * std::pow(worst, 2.0) - 1.0, 0.25, 3.0);
        try {
            if (!exchange.is_focused() && more == 3.0) focus(exchange, species, fluxes, options);
        } catch (const NumericsError&) {
        }
        look_where_expected(exchange, fluxes);
        exchange.gather(std::min(left, static_cast<std::uint64_t>(more * static_cast<double>(rays)) + 1));
    }
}

MethodChoice choose_method(double target, const TriangleMesh& mesh, const surface::RayScene& scene,
                           const LateralBox& box, const Species& species,
                           std::span<const std::int32_t> materials, const Wedges& wedges,
                           const TraceOptions& options) {
    MethodChoice choice;
    if (const std::string why = why_not_radiosity(species); !why.empty()) {
        choice.why_not = why;
        return choice;
    }
    TraceOptions pilot = options;
    pilot.rays = std::min<std::uint64_t>(options.rays, 4096 + mesh.triangles.size() / 4);
    pilot.progress = nullptr;
    const FluxResult result = trace_flux(mesh, scene, box, species, materials, wedges, pilot);
    // Errors and segments are the same on every machine, and so is the choice.
    const double growth = static_cast<double>(options.rays) / static_cast<double>(result.emitted);
    choice.target = target > 0.0 ? target : result.relative_error / std::sqrt(growth);
    const double more = std::max(1.0, std::pow(result.relative_error / choice.target, 2.0));
    choice.monte_carlo_cost = more * static_cast<double>(result.segments);
    const std::size_t unknowns = make_strip(make_geometry(mesh, scene, box), wedges).unknowns.count();
    const auto cost = [&](double rays) {
        return kRayCost * (rays * static_cast<double>(unknowns) + kPilotRays);
    };
    choice.radiosity_cost = cost(kFirstRays);
    if (choice.radiosity_cost < choice.monte_carlo_cost) try {
            const std::vector<double> sticking =
                options.sticking_by_wedge.empty()
                    ? sticking_by_wedge(wedges, materials, species)
                    : std::vector<double>(options.sticking_by_wedge.begin(), options.sticking_by_wedge.end());
            const DiffuseSpecies diffuse{
                .name = species.name, .source_exponent = species.source_exponent, .sticking = sticking};
            choice.rays = rays_needed(choice.target, mesh, scene, box, wedges, diffuse, options);
            choice.radiosity_cost = cost(choice.rays);
        } catch (const NumericsError&) {  // e.g. a pocket that so few rays do not leave
            choice.radiosity_cost = choice.monte_carlo_cost;
        }
    choice.radiosity = choice.radiosity_cost < choice.monte_carlo_cost;
    return choice;
}

}  // namespace sidewall::flux
