#include "app/process/state.hpp"

#include <fmt/format.h>

#include "app/common/json.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/checkpoint.hpp"
#include "surface/error.hpp"

namespace sidewall::app {

void RunState::advance(double dt, double stop) {
    const double after = time + dt;
    time = stop - after <= 1e-9 * dt ? stop : after;
    ++time_step;
    ++time_steps[step];
}

void RunState::enter(std::size_t next) {
    step = next;
    step_start = time;
    if (time_steps.size() <= next) time_steps.resize(next + 1, 0);
}

RunState initial_state(const Recipe& recipe) {
    std::vector<std::pair<int, levelset::Shape>> bodies;
    for (const MaterialLayer& layer : expanded_layers(recipe))
        bodies.emplace_back(layer.material, layer.shape);
    RunState state;
    state.stack = levelset::make_stack(domain_of(recipe), bodies);
    state.enter(0);
    return state;
}

RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe) {
    const auto path = folder / "checkpoint.vdb";
    levelset::Checkpoint checkpoint = levelset::load_checkpoint(path, domain_of(recipe));
    RunState state;
    state.stack = std::move(checkpoint.stack);
    try {
        const Json json = Json::from_cbor(checkpoint.text);
        if (json.at("recipe").get<std::string>() != effective_recipe(recipe))
            throw FileError("it was made by another recipe; compare with recipe.toml beside it");
        json.at("step").get_to(state.step);
        json.at("step_start").get_to(state.step_start);
        json.at("time").get_to(state.time);
        json.at("time_step").get_to(state.time_step);
        json.at("saved").get_to(state.saved);
        json.at("rows").get_to(state.rows);
        json.at("time_steps").get_to(state.time_steps);
        state.carried = surface_field_from_json(json.at("coverage"));
        json.at("reuse").at("left").get_to(state.reuse.left);
        json.at("reuse").at("since").get_to(state.reuse.since);
        for (const Json& file : json.at("files"))
            state.files.push_back({file.at("time").get<double>(), file.at("part").get<int>(),
                                   file.at("file").get<std::string>()});
        state.timing = timing_from_json(json.at("timing"));
    } catch (const std::exception& error) {
        throw FileError(fmt::format("{}: not a checkpoint of this recipe: {}; run without --resume",
                                    path.string(), error.what()));
    }
    return state;
}

void save_state(const std::filesystem::path& folder, const Recipe& recipe, const RunState& state) {
    Json files = Json::array();
    for (const SavedFile& file : state.files)
        files.push_back(Json{{"time", file.time}, {"part", file.part}, {"file", file.name}});
    const Json json{{"recipe", effective_recipe(recipe)},
                    {"step", state.step},
                    {"step_start", state.step_start},
                    {"time", state.time},
                    {"time_step", state.time_step},
                    {"saved", state.saved},
                    {"rows", state.rows},
                    {"time_steps", state.time_steps},
                    {"coverage", to_json(state.carried)},
                    {"reuse", {{"left", state.reuse.left}, {"since", state.reuse.since}}},
                    {"files", files},
                    {"timing", to_json(state.timing)}};
    const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
    levelset::save_checkpoint(folder / "checkpoint.vdb", state.stack, {bytes.begin(), bytes.end()});
}

}  // namespace sidewall::app
