#include "app/process/state.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/process/revision.hpp"
#include "app/process/run_options.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/steps.hpp"
#include "app/schema/keys.hpp"
#include "levelset/layers/checkpoint.hpp"
#include "levelset/layers/level_features.hpp"
#include "levelset/layers/make_stack.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

// JSON form of a point: a list of its coordinates; of a box: a list of its two corners.
template <>
struct nlohmann::adl_serializer<sidewall::Vec3> {
    static void to_json(sidewall::app::Json& json, const sidewall::Vec3& p) {
        json = std::array{p.x(), p.y(), p.z()};
    }
    static void from_json(const sidewall::app::Json& json, sidewall::Vec3& p) {
        p = sidewall::Vec3(json.get<std::array<double, 3>>().data());
    }
};
template <>
struct nlohmann::adl_serializer<sidewall::Box3> {
    static void to_json(sidewall::app::Json& json, const sidewall::Box3& box) {
        json = std::array{box.min, box.max};
    }
    static void from_json(const sidewall::app::Json& json, sidewall::Box3& box) {
        json.at(0).get_to(box.min);
        json.at(1).get_to(box.max);
    }
};

namespace sidewall::app {

// The fields that checkpoints hold. CBOR keeps every bit of the numbers.
SIDEWALL_JSON(Measure, name, value, unit)
SIDEWALL_JSON(Event, kind, time, step, material, count, volume, at)
SIDEWALL_JSON(StepNoise, squares, time, dt)
SIDEWALL_JSON(StepEnd, duration, stopped_by, grown, time, has_stop, endpoint, over_etch, endpoint_bare, bare,
              measures, noise)
SIDEWALL_JSON(History, initial, most, added, removed, layer_materials, layer_volumes, present, hanging, voids,
              bottom_reached, top_reached, events, ends)
SIDEWALL_JSON(InputFile, path, digest)
SIDEWALL_JSON(SavedFile, time, part, file, after)
SIDEWALL_JSON(SavedStack, time, step, materials)
SIDEWALL_JSON(SpeciesMethod, species, radiosity, reason, target, rays)
SIDEWALL_JSON(FluxReuse, left, since)
SIDEWALL_JSON(RunEndpoint, masks, time, key, bare)
SIDEWALL_JSON(RunState, step, epoch, step_start, starts, time, time_step, saved, rows, end_row, timeline,
              manifest, time_steps, endpoint, noise, reuse, methods, files, stacks, inputs, history, timing)

namespace {

// Checks what the time loop relies on; \p materials is the number of materials that layers may refer to.
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
        if (std::filesystem::path(file.file).filename() != file.file || !std::isfinite(file.time))
            throw FileError("it lists a file that no run saves");
}

}  // namespace

void RunState::begin_step(double duration) {
    // A step may have 1e7 time steps; each of them must be longer than the rounding of the time.
    constexpr double kShort = 1e-6;
    if (begins_step()) {
        endpoint = {};
        noise = {};
    }
    if (!begins_step() || !(duration > 0.0) || !(duration < kShort * process_time())) return;
    epoch = process_time();
    step_start = time = 0.0;
}

void RunState::advance(double dt, double stop) {
    constexpr double kLost = 0.1;  // share of dt by which rounding may change it
    const double after = time + dt;
    if (!(std::abs(after - time - dt) <= kLost * dt))
        throw NumericsError(
            "a time step of {:.3g} is lost in the rounding of the time, {:.6g}: shorten the step or lower its rates",
            dt, time);
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

std::set<std::string> input_paths(const Recipe& recipe) {
    std::set<std::string> paths{recipe.start.from};
    for (const Layer& layer : recipe.layers) paths.insert(layer.file);
    each_step(recipe.steps, [&](const Step& step, const std::string&) {
        paths.insert(step.pattern.file);
        each_key(model_keys(step), [&](const Key& key, const std::string&) {
            if (names_file(key)) paths.insert(*std::get<std::string*>(key.target));
        });
    });
    paths.erase("");
    return paths;
}

std::vector<InputFile> input_files(const std::set<std::string>& paths) {
    std::vector<InputFile> files;
    files.reserve(paths.size());
    for (const std::string& path : paths) {
        const std::filesystem::path file(path);
        const bool run = std::filesystem::is_directory(file);
        files.push_back({path, digest(surface::read_whole_file(run ? file / "checkpoint.vdb" : file))});
    }
    return files;
}

namespace {

// The recipe of a checkpoint with the present paths of its files; moved files are recognised by their
// digests.
std::string with_files_as_now(std::string text, const std::vector<InputFile>& then,
                              const std::vector<InputFile>& now) {
    for (const InputFile& old : then) {
        const auto name = [](const InputFile& file) { return std::filesystem::path(file.path).filename(); };
        const auto here = std::ranges::find(now, old.path, &InputFile::path);
        const auto same = here != now.end() ? here : std::ranges::find(now, old.digest, &InputFile::digest);
        const auto now_file = same != now.end() ? same : std::ranges::find(now, name(old), name);
        if (now_file == now.end()) continue;
        if (now_file->digest != old.digest) throw FileError("{} is not what it was", now_file->path);
        if (now_file->path == old.path) continue;
        const std::string from = toml_text(old.path), to = toml_text(now_file->path);
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

// Loads a checkpoint. If its domain differs, it cannot be read: the recipe.toml beside it then tells how.
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

}  // namespace

Checkpoint read_checkpoint(const std::filesystem::path& folder, const Recipe& recipe,
                           const std::string& advice) {
    levelset::Checkpoint loaded = loaded_from(folder, recipe, advice);
    try {
        const Json json = Json::from_cbor(loaded.text);
        Checkpoint checkpoint{json.get<RunState>(), json.at("recipe").get<std::string>(),
                              json.at("materials").get<std::vector<std::string>>(),
                              json.at("length_unit").get<std::string>()};
        checkpoint.state.carried = surface_field_from_json(json.at("coverage"));
        checkpoint.state.stack = std::move(loaded.stack);
        require_whole(checkpoint.state.history, checkpoint.materials.size(), checkpoint.state.step);
        check(checkpoint.state, checkpoint.materials.size());
        return checkpoint;
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& error) {
        throw unusable(folder, error.what(), advice);
    }
}

RunState resume_state(const std::filesystem::path& folder, const Recipe& recipe) {
    std::string advice = "choose another folder with -o, or start anew with --overwrite";
    if (std::filesystem::is_directory(folder / kAccuracyFolder))
        advice = "it was run to an accuracy: repeat its --accuracy, " + advice;
    Checkpoint checkpoint = read_checkpoint(folder, recipe, advice);
    try {
        const std::vector<InputFile> inputs = input_files(input_paths(recipe));
        const std::string text = with_files_as_now(checkpoint.recipe, checkpoint.state.inputs, inputs);
        checkpoint.state.inputs = inputs;
        if (text == effective_recipe(recipe)) return std::move(checkpoint.state);
        const Recipe began_with = parse_recipe(text, (folder / "recipe.toml").string());
        extend(checkpoint.state, recipe, began_with);
        resize_to_materials(checkpoint.state.history, recipe.materials.size());
    } catch (const Error& error) {
        throw unusable(folder, error.what(), advice);
    }
    return std::move(checkpoint.state);
}

void save_state(const std::filesystem::path& folder, const Recipe& recipe, const RunState& state) {
    Json json = state;
    json["recipe"] = effective_recipe(recipe);
    json["materials"] = material_names(recipe.materials);
    json["length_unit"] = recipe.domain.length_unit;
    json["coverage"] = to_json(state.carried);
    const std::vector<std::uint8_t> bytes = Json::to_cbor(json);
    levelset::save_checkpoint(folder / "checkpoint.vdb", state.stack, {bytes.begin(), bytes.end()});
}

}  // namespace sidewall::app
