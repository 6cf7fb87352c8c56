#include "app/process/summary.hpp"

#include <algorithm>

#include "app/common/json.hpp"
#include "app/common/threads.hpp"
#include "app/common/version.hpp"
#include "app/results/metrology.hpp"

namespace sidewall::app {
namespace {

Json steps_json(const std::vector<Step>& steps, const RunState& state) {
    Json list = Json::array();
    for (std::size_t k = 0; k < steps.size(); ++k)
        list.push_back(Json{{"name", steps[k].name},
                            {"model", steps[k].model},
                            {"duration", steps[k].duration},
                            {"time_steps", state.time_steps[k]}});
    return list;
}

Json flux_json(const TracedSurface& surface) {
    Json list = Json::array();
    if (!surface.arriving || !surface.arriving->trace) return list;
    for (const flux::FluxResult& flux : surface.arriving->trace->species)
        list.push_back(Json{{"rays", flux.emitted},
                            {"segments", flux.segments},
                            {"pass_species", flux.pass_species},
                            {"pass_place", flux.pass_place},
                            {"leaked", flux.leaked},
                            {"relative_error", number_or_null(flux.relative_error)}});
    return list;
}

// What the recipe measures, and what became of every material since time 0.
std::vector<Measure> final_measures(const Recipe& recipe, const RunState& state,
                                    const TriangleMesh& surface) {
    std::vector<Measure> measures = measure(recipe, state.stack, surface);
    const std::string &length = recipe.domain.length_unit, &time = recipe.domain.time_unit;
    const std::size_t materials = recipe.materials.size();
    const std::vector<double> before = material_volumes(initial_state(recipe).stack, materials),
                              after = material_volumes(state.stack, materials);
    double grown = 0.0;
    for (std::size_t m = 0; m < materials; ++m) {
        const double change = after[m] - before[m];
        grown += change;
        if (before[m] == 0.0 && after[m] == 0.0) continue;
        const std::string& name = recipe.materials[m].name;
        measures.push_back({"added_volume_" + name, std::max(0.0, change), length + "^3"});
        measures.push_back({"removed_volume_" + name, std::max(0.0, -change), length + "^3"});
    }
    // Of the wafer as a whole: growth if positive, etching if negative.
    if (state.time > 0.0)
        measures.push_back({"mean_rate",
                            grown / (recipe.domain.extent[0] * recipe.domain.extent[1] * state.time),
                            length + "/" + time});
    return measures;
}

}  // namespace

Json summary_of(const Recipe& recipe, const RunState& state, const std::vector<Step>& steps,
                const TracedSurface& surface) {
    Json summary{{"version", version()},
                 {"recipe", recipe.file},
                 {"seed", recipe.flux.seed},
                 {"threads", thread_count()},
                 {"length_unit", recipe.domain.length_unit},
                 {"time_unit", recipe.domain.time_unit},
                 {"grid_spacing", state.stack.domain.spacing},
                 {"time", state.time},
                 {"time_steps", state.time_step},
                 {"steps", steps_json(steps, state)},
                 {"timing", to_json(state.timing)},
                 {"mesh", {{"raw", mesh_sizes(surface.raw)}, {"simplified", mesh_sizes(surface.traced())}}},
                 {"flux", flux_json(surface)},
                 {"metrology", Json::object()},
                 {"metrology_units", Json::object()}};
    for (const Measure& m : final_measures(recipe, state, surface.raw)) {
        summary["metrology"][m.name] = number_or_null(m.value);
        summary["metrology_units"][m.name] = m.unit;
    }
    if (surface.arriving && surface.arriving->trace && !surface.arriving->coverage.empty())
        summary["coverage"] = Json{{"traces", surface.arriving->trace->traces},
                                   {"mean_change", surface.arriving->trace->coverage_change}};
    return summary;
}

}  // namespace sidewall::app
