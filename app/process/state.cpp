#include "app/process/state.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <new>

#include "app/common/json.hpp"
#include "app/process/extension.hpp"
#include "app/recipe/differences.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/checkpoint.hpp"
#include "surface/error.hpp"
#include "surface/printable.hpp"

namespace sidewall::app {
namespace {

// What the time loop relies on, of a state whose layers are of so many materials.
void check(const RunState& state, std::size_t materials) {
    const bool times = state.step_start >= 0.0 && state.time >= state.step_start && std::isfinite(state.time);
    if (!times || state.time_steps.size() != state.step + 1)
        throw FileError("its steps and times do not fit together");
    for (const levelset::Layer& layer : state.stack.layers)
        if (layer.material < 0 || static_cast<std::size_t>(layer.material) >= materials)
            throw FileError("it holds a layer of an unknown material");
    for (const SavedFile& file : state.files)
        if (std::filesystem::path(file.name).filename() != file.name || !std::isfinite(file.time))
            throw FileError("it lists a file that no run saves");
}

}  // namespace

void RunState::advance(double dt, double stop) {
    const double after = time + dt;
    time = stop - after <= 1e-9 * dt ? stop : after;
    ++time_step;
    ++time_steps[step];
}

void RunState::enter(std::size_t next) {
    step = next;
    step_start = time;
    time_steps.resize(next + 1, 0);
    starts.resize(next + 1, time);
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

namespace {

FileError unusable(const std::filesystem::path& folder, const std::string& reason) {
    return FileError(
        fmt::format("{}: this recipe cannot go on from it: {}; choose another folder with -o, or start "
                    "anew with --overwrite",
                    (folder / "checkpoint.vdb").string(), reason));
}

// A checkpoint of another domain cannot be read; the recipe beside it tells what is different.
levelset::Checkpoint load(const std::filesystem::path& folder, const Recipe& recipe) {
    try {
        return levelset::load_checkpoint(folder / "checkpoint.vdb", domain_of(recipe));
    } catch (const FileError& error) {
        const auto copy = folder / "recipe.toml";
        if (!std::filesystem::exists(copy)) throw;
        DomainSection there;
        try {
            there = load_recipe(copy).domain;
        } catch (const Error&) {
            throw error;
        }
        if (there == recipe.domain) throw;
        Recipe other = recipe;
        other.domain = there;
        throw unusable(folder,
                       fmt::format("the recipes differ in {}", fmt::join(differences(recipe, other), ", ")));
    }
}

}  // namespace

RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe) {
    levelset::Checkpoint checkpoint = load(folder, recipe);
    RunState state;
    state.stack = std::move(checkpoint.stack);
    try {
        const Json json = Json::from_cbor(checkpoint.text);
        json.at("step").get_to(state.step);
        json.at("step_start").get_to(state.step_start);
        json.at("starts").get_to(state.starts);
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
        if (state.starts.size() != state.step + 1) throw FileError("its steps do not fit together");
        const auto began_with = json.at("recipe").get<std::string>();
        if (began_with != effective_recipe(recipe))
            extend(state, recipe, parse_recipe(began_with, (folder / "recipe.toml").string()));
        check(state, recipe.materials.size());
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw unusable(folder, surface::printable(error.what()));
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
                    {"starts", state.starts},
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
