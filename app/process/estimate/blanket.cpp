#include "app/process/estimate/blanket.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/models/model.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

// Every tally of every species on a flat wafer, and the scales of those that depend on the material.
struct FlatFluxes {
    std::vector<double> tallies;
    std::vector<std::vector<double>> scales;  // by tally; empty: the same on all materials

    std::vector<double> on(int material) const {
        std::vector<double> fluxes = tallies;
        for (std::size_t k = 0; k < fluxes.size(); ++k)
            if (!scales[k].empty()) fluxes[k] *= scales[k].at(static_cast<std::size_t>(material));
        return fluxes;
    }
};

FlatFluxes flat_fluxes(const Model& model) {
    FlatFluxes fluxes;
    const auto add = [&](double flux, std::vector<double> scales) {
        fluxes.tallies.push_back(flux);
        fluxes.scales.push_back(std::move(scales));
    };
    for (const flux::Species& species : model.species) {
        add(1.0, {});
        for (const flux::Yield& yield : species.yields) {
            flux::Yield unscaled = yield;
            unscaled.scale = {1.0};
            const double mean = flux::mean_yield(species, unscaled);
            if (yield.scale.size() == 1)
                add(mean * yield.scale[0], {});
            else
                add(mean, yield.scale);
        }
        if (species.redeposition) add(0.0, {});
    }
    return fluxes;
}

// Coverages under these fluxes.
std::vector<double> flat_coverages(const Model& model, SurfacePoint point, double duration) {
    const Coverages& coverages = model.coverages;
    std::vector<double> theta(coverages.names.size(), 0.0);
    if (theta.empty()) return theta;
    const auto react = [&](double time) {
        const std::vector<double> before = theta;
        point.coverage = before;
        coverages.react(point, time, theta);
        double change = 0.0;
        for (std::size_t k = 0; k < theta.size(); ++k)
            change = std::max(change, std::abs(theta[k] - before[k]));
        return change;
    };
    if (coverages.pulse > 0.0) {
        for (int part = 0; part < coverages.parts; ++part) react(coverages.pulse / coverages.parts);
    } else if (coverages.transient) {
        react(duration);
    } else {
        constexpr int kMostRounds = 100;
        constexpr double kSettled = 1e-9;
        for (int round = 0; round < kMostRounds && react(0.0) > kSettled;) ++round;
    }
    return theta;
}

std::string rate_text(double rate) {
    return rate == 0.0 ? "0" : fmt::format("{:+.3g}", rate);
}

// What the rates mean, in a sentence.
std::string meaning(const StepMaterials& here, const std::vector<BlanketRate>& rates, const Recipe& recipe,
                    double to_nm) {
    const auto name = [&](int id) { return recipe.materials[static_cast<std::size_t>(id)].name; };
    const auto deposit = here.step->built->deposit;
    std::vector<std::string> grown, etched, still;
    for (const BlanketRate& at : rates) {
        if (!at.unknown.empty()) continue;
        const std::string text = fmt::format("{}: {}", name(at.material), rate_text(to_nm * at.rate));
        (at.rate > 0.0   ? grown
         : at.rate < 0.0 ? etched
                         : still)
            .push_back(at.rate == 0.0 ? name(at.material) : text);
    }
    std::string words;
    if (!grown.empty())
        words = fmt::format("grows {} on {}; ", deposit ? name(*deposit) : "a film", fmt::join(grown, ", "));
    words += etched.empty() ? "nothing is etched" : fmt::format("etches {}", fmt::join(etched, ", "));
    if (!still.empty())
        words += fmt::format("; {} {} still", fmt::join(still, ", "), still.size() > 1 ? "stand" : "stands");
    return words;
}

// Of the material that is etched fastest to the others.
std::string selectivities(const std::vector<BlanketRate>& rates, const Recipe& recipe) {
    const auto fastest = std::ranges::min_element(rates, {}, &BlanketRate::rate);
    if (fastest == rates.end() || !(fastest->rate < 0.0)) return {};
    const auto name = [&](int id) { return recipe.materials[static_cast<std::size_t>(id)].name; };
    std::vector<std::string> list;
    for (const BlanketRate& at : rates)
        if (at.rate < 0.0 && at.material != fastest->material)
            list.push_back(fmt::format("{} : {} {:.3g}", name(fastest->material), name(at.material),
                                       fastest->rate / at.rate));
    return list.empty() ? "" : fmt::format("; selectivity {}", fmt::join(list, ", "));
}

}  // namespace

std::vector<BlanketRate> blanket_rates(const StepMaterials& here) {
    const Model& model = *here.step->built;
    const FlatFluxes flat = flat_fluxes(model);
    std::vector<BlanketRate> rates;
    rates.reserve(here.ids.size());
    for (const int id : here.ids) {
        BlanketRate& at = rates.emplace_back(BlanketRate{id, 0.0, {}});
        try {
            const std::vector<double> fluxes = flat.on(id);
            SurfacePoint point{id, fluxes};
            if (model.coverages.transient) point.time = here.step->duration;
            const std::vector<double> theta = flat_coverages(model, point, here.step->duration);
            point.coverage = theta;
            at.rate = model.speed(point);
        } catch (const NumericsError& error) {
            at.unknown = error.what();
        }
    }
    return rates;
}

std::string blanket_table(const Recipe& recipe) {
    const DomainSection& domain = recipe.domain;
    const double to_nm = 1e9 * metres_in(domain.length_unit);
    constexpr std::size_t kMostSteps = 200;
    std::vector<StepMaterials> steps = materials_by_step(recipe);
    const bool more = steps.size() > kMostSteps;
    if (more) steps.resize(kMostSteps);
    std::string text;
    for (const StepMaterials& here : steps) {
        const std::vector<BlanketRate> rates = blanket_rates(here);
        const std::string& name = here.step->name;
        text += fmt::format("# {} {}{}: {}{}\n", here.path, here.step->model, name.empty() ? "" : " " + name,
                            meaning(here, rates, recipe, to_nm), selectivities(rates, recipe));
        const Step& step = *here.step;
        const bool etches = std::ranges::any_of(rates, [](const BlanketRate& at) { return at.rate < 0.0; });
        if (!etches && (step.stop_depth || !step.stop_material.empty()))
            text += fmt::format("#   {} never ends it: nothing is etched\n",
                                step.stop_depth ? "stop_depth" : "stop_material");
        for (const BlanketRate& at : rates)
            if (!at.unknown.empty())
                text += fmt::format("#   {}: no rate: {}\n",
                                    recipe.materials[static_cast<std::size_t>(at.material)].name, at.unknown);
    }
    if (text.empty()) return text;
    if (more) text += fmt::format("# and further steps than these {}\n", kMostSteps);
    return fmt::format("#\n# Blanket rates, of an open flat wafer, in nm/{}:\n", domain.time_unit) + text;
}

}  // namespace sidewall::app
