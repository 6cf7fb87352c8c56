#include "app/process/state.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <new>
#include <set>

#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/process/revision.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/schema/keys.hpp"
#include "levelset/layers/checkpoint.hpp"
#include "levelset/layers/level_features.hpp"
#include "levelset/layers/make_stack.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// What the time loop relies on, of a state whose layers are of so many materials.
void check(const RunState& state, std::size_t materials) {
    const bool times = state.epoch >= 0.0 && state.step_start >= 0.0 && state.time >= state.step_start &&
                       std::isfinite(state.process_time());
    if (!times || state.time_steps.size() != state.step + 1 || state.starts.size() != state.step + 1)
        throw FileError("its steps and times do not fit together");
    const auto known = [&](int material) {
        return material >= 0 && static_cast<std::size_t>(material) < materials;
    };
    for (const levelset::Layer& layer : state.stack.layers)
        if (!known(layer.material)) throw FileError("it holds a layer of an unknown material");
    for (const SavedStack& stack : state.stacks)
        if (stack.materials.empty() || stack.step > state.step ||
            !std::all_of(stack.materials.begin(), stack.materials.end(), known))
            throw FileError("its saved layers do not fit together");
    for (const SavedFile& file : state.files)
        if (std::filesystem::path(file.name).filename() != file.name || !std::isfinite(file.time))
            throw FileError("it lists a file that no run saves");
}

}  // namespace

void RunState::begin_step(double duration) {
    // Time steps may be 1e7 times shorter than the step, and must be longer than the rounding of the time.
    constexpr double kShort = 1e-6;
    if (begins_step()) endpoint = {};
    if (!begins_step() || !(duration > 0.0) || !(duration < kShort * process_time())) return;
    epoch = process_time();
    step_start = time = 0.0;
}

void RunState::advance(double dt, double stop) {
    constexpr double kLost = 0.1;  // of dt, which rounding may take from it or add to it
    const double after = time + dt;
    if (!(std::abs(after - time - dt) <= kLost * dt))
        throw NumericsError(fmt::format(
            "a time step of {:.3g} is lost in the rounding of the time, {:.6g}: shorten the step or lower its rates",
            dt, time));
    time = stop - after <= 1e-9 * dt ? stop : after;
    ++time_step;
    ++time_steps[step];
}

bool RunState::chooses_columns() const {
    return stack.coarser && time_step % levelset::kTimeStepsBetweenChoices == 0;
}

void RunState::enter(std::size_t next) {
    step = next;
    step_start = time;
    time_steps.resize(next + 1, 0);
    starts.resize(next + 1, process_time());
}

std::vector<InputFile> input_files(const Recipe& recipe) {
    std::set<std::string> paths;
    for (const Layer& layer : recipe.layers) paths.insert(layer.file);
    for (const Step& step : expanded_steps(recipe)) paths.insert(step.pattern.file);
    paths.erase("");
    std::vector<InputFile> files;
    files.reserve(paths.size());
    for (const std::string& path : paths) files.push_back({path, digest(surface::read_whole_file(path))});
    return files;
}

namespace {

// The recipe of a checkpoint with the paths of its files as they are now: files that were moved are known by
// their bytes.
std::string with_files_as_now(std::string text, const std::vector<InputFile>& then,
                              const std::vector<InputFile>& now) {
    for (const InputFile& old : then) {
        const auto same = std::find_if(now.begin(), now.end(),
                                       [&](const InputFile& file) { return file.digest == old.digest; });
        const auto name = [](const InputFile& file) { return std::filesystem::path(file.path).filename(); };
        const auto namesake = std::find_if(now.begin(), now.end(),
                                           [&](const InputFile& file) { return name(file) == name(old); });
        if (same == now.end() && namesake != now.end())
            throw FileError(fmt::format("{} is not what it was", namesake->path));
        if (same == now.end() || same->path == old.path) continue;
        const std::string from = toml_text(old.path), to = toml_text(same->path);
        for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
            text.replace(at, from.size(), to);
    }
    return text;
}

FileError unusable(const std::filesystem::path& folder, const std::string& reason,
                   const std::string& advice) {
    return FileError(fmt::format("{}: this recipe cannot go on from it: {}; {}",
                                 (folder / "checkpoint.vdb").string(), surface::printable(reason), advice));
}

// Loads a checkpoint. One of another domain cannot be read; the recipe beside it shows what is different.
levelset::Checkpoint loaded_from(const std::filesystem::path& folder, const Recipe& recipe,
                                 const std::string& advice) {
    try {
        return levelset::load_checkpoint(folder / "checkpoint.vdb", domain_of(recipe));
    } catch (const FileError& error) {
        const FileError damaged(fmt::format("{}; {}", error.what(), advice));
        const auto copy = folder / "recipe.toml";
        if (!std::filesystem::exists(copy)) throw damaged;
        Recipe other = recipe;
        try {
            other.domain = load_recipe(copy).domain;
        } catch (const Error&) {
            throw damaged;
        }
        if (other.domain == recipe.domain) throw damaged;
        throw unusable(folder,
                       fmt::format("the recipes differ in {}", fmt::join(differences(recipe, other), ", ")),
                       advice);
    }
}

RunState state_from_json(const Json& json) {
    RunState state;
    json.at("step").get_to(state.step);
    state.epoch = json.value("epoch", 0.0);  // since version 0.3
    json.at("step_start").get_to(state.step_start);
    json.at("starts").get_to(state.starts);
    json.at("time").get_to(state.time);
    json.at("time_step").get_to(state.time_step);
    json.at("saved").get_to(state.saved);
    json.at("rows").get_to(state.rows);
    state.end_row = json.value("end_row", "");
    state.timeline = json.value("timeline", "");  // since version 0.3
    state.manifest = json.value("manifest", "");
    json.at("time_steps").get_to(state.time_steps);
    state.carried = surface_field_from_json(json.at("coverage"));
    if (json.contains("endpoint")) {  // since version 0.3
        const Json& endpoint = json["endpoint"];
        if (const Json& masks = endpoint.at("masks"); !masks.is_null())
            state.endpoint.masks = masks.get<std::vector<int>>();
        if (!endpoint.at("time").is_null()) state.endpoint.time = endpoint["time"].get<double>();
        endpoint.at("key").get_to(state.endpoint.key);
        if (!endpoint.at("bare").is_null()) state.endpoint.bare = endpoint["bare"].get<double>();
    }
    json.at("reuse").at("left").get_to(state.reuse.left);
    json.at("reuse").at("since").get_to(state.reuse.since);
    if (json.contains("methods"))  // of earlier versions none
        for (const Json& method : json.at("methods"))
            state.methods.push_back({method.at("species").get<std::string>(),
                                     method.at("radiosity").get<bool>(),
                                     method.at("reason").get<std::string>(), method.value("target", 0.0),
                                     method.value("rays", 0.0)});  // later keys
    for (const Json& file : json.at("files"))
        state.files.push_back({file.at("time").get<double>(), file.at("part").get<int>(),
                               file.at("file").get<std::string>(), file.value("after", "")});
    for (const Json& stack : json.at("stacks"))
        state.stacks.push_back({stack.at("time").get<double>(), stack.at("step").get<std::size_t>(),
                                stack.at("materials").get<std::vector<int>>()});
    if (json.contains("inputs"))  // of earlier versions none
        for (const Json& file : json.at("inputs"))
            state.inputs.push_back(
                {file.at("path").get<std::string>(), file.at("digest").get<std::string>()});
    state.history = history_from_json(json.at("history"), json.at("materials").size(), state.step);
    state.timing = timing_from_json(json.at("timing"));
    return state;
}

}  // namespace

Checkpoint read_checkpoint(const std::filesystem::path& folder, const Recipe& recipe,
                           const std::string& advice) {
    levelset::Checkpoint loaded = loaded_from(folder, recipe, advice);
    try {
        const Json json = Json::from_cbor(loaded.text);
        Checkpoint checkpoint{state_from_json(json), json.at("recipe").get<std::string>(),
                              json.at("materials").get<std::vector<std::string>>(),
                              json.at("length_unit").get<std::string>()};
        checkpoint.state.stack = std::move(loaded.stack);
        check(checkpoint.state, checkpoint.materials.size());
        return checkpoint;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw unusable(folder, error.what(), advice);
    }
}

RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe) {
    const std::string advice = "choose another folder with -o, or start anew with --overwrite";
    Checkpoint checkpoint = read_checkpoint(folder, recipe, advice);
    try {
        const std::vector<InputFile> inputs = input_files(recipe);
        const std::string text = with_files_as_now(checkpoint.recipe, checkpoint.state.inputs, inputs);
        checkpoint.state.inputs = inputs;
        if (text == effective_recipe(recipe)) return std::move(checkpoint.state);
        const Recipe began_with = parse_recipe(text, (folder / "recipe.toml").string());
        extend(checkpoint.state, recipe, began_with);
        fit(checkpoint.state.history, recipe.materials.size());
    } catch (const Error& error) {
        throw unusable(folder, error.what(), advice);
    }
    return std::move(checkpoint.state);
}

void save_state(const std::filesystem::path& folder, const Recipe& recipe, const RunState& state) {
    Json files = Json::array(), stacks = Json::array(), methods = Json::array(), inputs = Json::array();
    for (const InputFile& file : state.inputs)
        inputs.push_back(Json{{"path", file.path}, {"digest", file.digest}});
    for (const SavedFile& file : state.files)
        files.push_back(
            Json{{"time", file.time}, {"part", file.part}, {"file", file.name}, {"after", file.after}});
    for (const SavedStack& stack : state.stacks)
        stacks.push_back(Json{{"time", stack.time}, {"step", stack.step}, {"materials", stack.materials}});
    for (const SpeciesMethod& method : state.methods)
        methods.push_back(Json{{"species", method.species},
                               {"radiosity", method.radiosity},
                               {"reason", method.reason},
                               {"target", method.target},
                               {"rays", method.rays}});
    const Json json{{"recipe", effective_recipe(recipe)},
                    {"materials", material_names(recipe.materials)},
                    {"length_unit", recipe.domain.length_unit},
                    {"step", state.step},
                    {"epoch", state.epoch},
                    {"step_start", state.step_start},
                    {"starts", state.starts},
                    {"time", state.time},
                    {"time_step", state.time_step},
                    {"saved", state.saved},
                    {"rows", state.rows},
                    {"end_row", state.end_row},
                    {"timeline", state.timeline},
                    {"manifest", state.manifest},
                    {"time_steps", state.time_steps},
                    {"coverage", to_json(state.carried)},
                    {"endpoint",
                     {{"masks", state.endpoint.masks ? Json(*state.endpoint.masks) : Json()},
                      {"time", state.endpoint.time ? Json(*state.endpoint.time) : Json()},
                      {"key", state.endpoint.key},
                      {"bare", state.endpoint.bare ? Json(*state.endpoint.bare) : Json()}}},
                    {"reuse", {{"left", state.reuse.left}, {"since", state.reuse.since}}},
                    {"methods", methods},
                    {"files", files},
                    {"stacks", stacks},
                    {"inputs", inputs},
                    {"history", to_json(state.history)},
                    {"timing", to_json(state.timing)}};
    const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
    levelset::save_checkpoint(folder / "checkpoint.vdb", state.stack, {bytes.begin(), bytes.end()});
}

}  // namespace sidewall::app
