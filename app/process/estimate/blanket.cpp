#include "app/process/estimate/blanket.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "app/models/geometric_steps.hpp"
#include "app/models/model.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/recipe/notes.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

// Fluxes of all tallies on a flat wafer, and factors for those that depend on the material.
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

// The coverages that result from the fluxes of \p point.
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

// Describes the rates in a sentence.
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

// The selectivities of the fastest etched material to each of the others.
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

// Lower bound of the wafer's lowest point before all steps; -infinity where a file or a pattern decides.
double lowest_at_start(const Recipe& recipe) {
    double lowest = recipe.layers.empty() || !recipe.start.from.empty() ? -kInfinity : kInfinity;
    for (const Layer& layer : recipe.layers) {
        const bool flat = layer.shape == "plane" || layer.shape == "stack" || layer.shape == "fin" ||
                          layer.shape == "box" || layer.shape == "mask",
                   recess = layer.shape == "trench" || layer.shape == "hole";
        if (layer.subtract || !(flat || recess)) return -kInfinity;
        const double top = layer.top.value_or(0.0);  // a stack's top lies above that
        // A recess without a depth ends on the layer below.
        lowest = std::min(lowest, recess && layer.depth ? top - *layer.depth : top);
    }
    return lowest;
}

// Upper bounds of the depth etched and the thickness grown.
struct Reach {
    double etched = 0.0, grown = 0.0;

    Reach& operator+=(const Reach& other) {
        etched += other.etched;
        grown += other.grown;
        return *this;
    }
};

// Adds up what the steps of a recipe reach at their blanket rates, and notes the stop conditions beyond that.
class StopCheck {
  public:
    explicit StopCheck(const Recipe& recipe) : recipe_(recipe), lowest_(lowest_at_start(recipe)) {
        for (const StepMaterials& here : materials_by_step(recipe)) materials_.emplace(here.step, here);
        through(recipe.steps, {}, "step");
    }

    std::vector<std::string> notes;

  private:
    Reach through(const std::vector<Step>& steps, const Reach& before, const std::string& list) {
        Reach all;
        for (std::size_t k = 0; k < steps.size(); ++k) {
            const Step& step = steps[k];
            const std::string path = fmt::format("{}[{}]", list, k);
            Reach so_far = before;
            so_far += all;
            all += step.steps.empty() ? meet(step, so_far, path) : rounds(step, so_far, path);
        }
        return all;
    }

    // Checks a loop's steps in its last pass, after all others.
    Reach rounds(const Step& loop, Reach before, const std::string& path) {
        std::vector<std::string> kept = std::move(notes);
        notes.clear();
        const Reach one = through(loop.steps, before, path + ".steps");
        const auto more = static_cast<double>(loop.repeat - 1);
        const Reach others = loop.repeat > 1 ? Reach{more * one.etched, more * one.grown} : Reach{};
        before += others;
        notes = std::move(kept);
        Reach all = through(loop.steps, before, path + ".steps");
        all += others;
        return all;
    }

    Reach meet(const Step& step, const Reach& before, const std::string& path) {
        const auto at = materials_.find(&step);
        if (at == materials_.end()) {  // takes no time; only `mask` leaves the floor unchanged
            const double lowest = lowest_ - before.etched;
            if (step.model == "fill" && geometric_step(step.parameters)->height <= lowest)
                notes.push_back(fmt::format(
                    "{}.height fills nothing: no place of the wafer lies below z = {:.3g}", path, lowest));
            return step.model == "mask" ? Reach{} : Reach{kInfinity, kInfinity};
        }
        Reach reach = most_of(at->second);
        reach.etched *= step.duration;
        reach.grown *= step.duration;
        Reach end = before;
        end += reach;
        note_stops(at->second, end);
        return reach;
    }

    // The fastest blanket rates; infinite if a surface may move faster than an open wafer's.
    static Reach most_of(const StepMaterials& here) {
        const Model& model = *here.step->built;
        if (here.step->model == "formula" || model.beam ||
            std::ranges::any_of(model.species, [](const flux::Species& s) { return !s.yields.empty(); }))
            return {kInfinity, kInfinity};
        Reach most;
        for (const BlanketRate& at : blanket_rates(here)) {
            if (!at.unknown.empty()) return {kInfinity, kInfinity};
            most.etched = std::max(most.etched, -at.rate);
            most.grown = std::max(most.grown, at.rate);
        }
        return most;
    }

    void note_stops(const StepMaterials& here, const Reach& end) {
        const Step& step = *here.step;
        const double depth = end.etched - lowest_;
        if (step.stop_depth) note_depth(here, "stop_depth", *step.stop_depth, depth);
        if (step.stop_thickness && step.built->deposit && !is_layer(*step.built->deposit))
            note_film(here, "stop_thickness", *step.stop_thickness, end.grown);
        const auto bare = bare_rule(recipe_, step);
        if (bare && !etches_another(here, bare->bare))
            notes.push_back(fmt::format(
                "{}.{} ends the step at once or never: nothing that could cover {} is etched on an open wafer",
                here.path, step.stop.empty() ? "stop_material" : "stop",
                recipe_.materials[static_cast<std::size_t>(bare->bare)].name));
        if (bare || step.stop.empty()) return;
        const StopRule rule = stop_rule(recipe_, step.stop);
        if (rule.figure == "depth" && rule.above)
            note_depth(here, "stop", rule.value, depth + recipe_.metrology.mask_bottom);
        if (rule.figure.starts_with("film_") && rule.above && step.built->deposit &&
            !is_layer(*step.built->deposit))
            note_film(here, "stop", rule.value, end.grown);
    }

    static bool etches_another(const StepMaterials& here, int material) {
        const std::vector<BlanketRate> rates = blanket_rates(here);
        return std::ranges::any_of(rates, [&](const BlanketRate& at) {
            return at.material != material && (at.rate < 0.0 || !at.unknown.empty());
        });
    }

    bool is_layer(int material) const {
        const std::string& name = recipe_.materials[static_cast<std::size_t>(material)].name;
        return std::ranges::any_of(recipe_.layers, [&](const Layer& layer) {
            return layer.material == name || std::ranges::count(layer.materials, name) > 0;
        });
    }

    void note_depth(const StepMaterials& here, const char* key, double asked, double reached) {
        if (asked > reached + recipe_.domain.grid_spacing)
            add(here, key,
                fmt::format("at blanket rates the steps up to its end reach a depth of {:.3g} {} at most",
                            reached, recipe_.domain.length_unit));
    }

    void note_film(const StepMaterials& here, const char* key, double asked, double grown) {
        if (asked > grown + recipe_.domain.grid_spacing)
            add(here, key,
                fmt::format("at blanket rates the steps up to its end grow {:.3g} {} at most", grown,
                            recipe_.domain.length_unit));
    }

    void add(const StepMaterials& here, const char* key, const std::string& why) {
        notes.push_back(fmt::format("{}.{} never ends the step: {}", here.path, key, why));
    }

    const Recipe& recipe_;
    double lowest_;
    std::map<const Step*, StepMaterials> materials_;
};

}  // namespace

std::vector<std::string> unmet_stops(const Recipe& recipe) {
    return StopCheck(recipe).notes;
}

std::vector<std::string> notes_before_run(const Recipe& recipe) {
    std::vector<std::string> notes = notes_on(recipe);
    std::ranges::move(unmet_stops(recipe), std::back_inserter(notes));
    return notes;
}

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
            at.rate = model.speeds ? model.speeds({&point, 1}).front() : model.speed(point);
        } catch (const NumericsError& error) {
            at.unknown = error.what();
        }
    }
    return rates;
}

double fastest_blanket(const Recipe& recipe, const Step& step) {
    double fastest = 0.0;
    for (const StepMaterials& here : materials_by_step(recipe))
        if (here.step->built == step.built)
            for (const BlanketRate& at : blanket_rates(here)) fastest = std::max(fastest, std::abs(at.rate));
    return fastest;
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
