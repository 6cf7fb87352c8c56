#include "app/process/record/run_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "app/common/json.hpp"
#include "app/common/processes.hpp"
#include "app/common/text.hpp"
#include "app/process/noise.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/process/record/summary.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "surface/cut.hpp"
#include "surface/files/file.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::app {
namespace {

// Refuses to replace the user's recipe file by the effective recipe, which has no comments.
void spare_recipe(const std::string& file, const fs::path& copy, const std::string& effective) {
    std::error_code failure;
    if (fs::equivalent(file, copy, failure) && surface::read_whole_file(copy) != effective)
        throw RecipeError(
            "{}: the run would write its effective recipe over this file: choose another folder with -o",
            file);
}

// A number larger than the number of surfaces that any run of the recipe saves.
std::size_t above_saved(const Recipe& recipe) {
    const std::vector<Step> steps = expanded_steps(recipe);
    if (!recipe.output.every) return steps.size() + 1;
    return static_cast<std::size_t>(total_duration(steps) / *recipe.output.every) + 2;
}

// Removes the runs to an accuracy that were made beside an earlier run.
void remove_records(const fs::path& records) {
    std::error_code failure;
    if (!fs::is_directory(fs::symlink_status(records, failure)) || accuracy_records(records).empty()) return;
    {
        const FolderLock lock(records);
        remove_accuracy_records(records);
    }
    fs::remove(records, failure);  // fails if it is not empty
}

std::string profile_name(const std::string& number, std::size_t plane) {
    return plane == 0 ? fmt::format("profile_{}.csv", number)
                      : fmt::format("profile_{}_{}.csv", number, plane);
}

// Counts the last step's end row among the timeline's rows: another row follows, so it is final.
void count_end_row(RunState& state) {
    if (!state.end_row.empty()) ++state.rows;
    state.end_row.clear();
}

std::string with_measures(std::string row, const std::vector<Measure>& measures) {
    for (const Measure& m : measures)  // empty if the wafer lacks the figure
        row += std::isfinite(m.value) ? fmt::format(",{:.9g}", m.value) : ",";
    return row;
}

}  // namespace

RunFolder::RunFolder(const RunOptions& options, const Recipe& recipe)
    : options_(options),
      recipe_(recipe),
      effective_(effective_recipe(recipe)),
      writes_(options.shares.rank == 0),
      goes_on_(options.resume) {
    if (writes_) claim();
    goes_on_ = flux::of_first(options.shares, goes_on_ ? 1 : 0) == 1;
    finished_ = flux::of_first(options.shares, is_there(options.output / "summary.json") ? 1 : 0) == 1;
}

void RunFolder::claim() {
    make_folder(options_.output, "choose another with -o");
    lock_.emplace(options_.output);
    for (const std::string& name : run_file_names()) surface::place_of(options_.output / name);
    surface::place_of(options_.output / kManifest);
    std::error_code failure;
    if (fs::equivalent(options_.output, recipe_.start.from, failure))
        throw RecipeError("{}: start.from is the folder to write to: choose another with -o",
                          options_.output.string());
    spare_recipe(recipe_.file, options_.output / "recipe.toml", effective_);
    const std::optional<FileNames> listed = read_manifest(options_.output);
    if (listed) names_ = *listed;
    // A run that never began, or was killed before its first checkpoint, begins at time 0.
    if (holds() == Held::nothing) goes_on_ = false;
    if (options_.overwrite) {
        if (!listed) take_over();
        return;
    }
    if (goes_on_) return;
    refuse_foreign_files(listed.has_value());
    refuse_other_runs();
}

RunFolder::Held RunFolder::holds() const {
    const bool same = holds_recipe(options_.output, effective_);
    if (is_there(options_.output / "summary.json")) return same ? Held::result : Held::other_result;
    if (is_there(options_.output / "checkpoint.vdb")) return same ? Held::run : Held::other_run;
    const bool surfaces = std::any_of(names_.begin(), names_.end(), [&](const std::string& name) {
        return saved_number(name) && is_there(options_.output / name);
    });
    return same || !surfaces ? Held::nothing : Held::other_run;
}

void RunFolder::refuse_foreign_files(bool has_manifest) const {
    const std::size_t above = above_saved(recipe_);
    std::string foreign;
    for (const auto& entry : fs::directory_iterator(options_.output)) {
        const std::string name = entry.path().filename().string();
        const std::optional<std::size_t> number = saved_number(name);
        const bool ours = run_file_names().contains(name) || (number && *number < above) ||
                          (name == kManifest && !has_manifest);
        if (!ours || names_.contains(name)) continue;
        if (name == "recipe.toml" && surface::read_whole_file(entry.path()) == effective_) continue;
        if (foreign.empty() || name < foreign) foreign = name;
    }
    if (!foreign.empty())
        throw RecipeError(
            "{}: the run would write over this file, which is in no list of what a "
            "run wrote there ({}): choose another folder with -o, or --overwrite it",
            (options_.output / foreign).string(), kManifest);
}

// Lists what to overwrite in a folder without a manifest: files that its surface.pvd names, and files that
// this run may write.
void RunFolder::take_over() {
    const fs::path pvd = options_.output / "surface.pvd";
    const std::string listed = fs::is_regular_file(pvd) ? surface::read_whole_file(pvd) : "";
    const std::size_t above = above_saved(recipe_);
    for (const auto& entry : fs::directory_iterator(options_.output)) {
        const std::string name = entry.path().filename().string();
        const std::optional<std::size_t> number = saved_number(name);
        if (number && (*number < above ||
                       listed.find(fmt::format("file=\"surface_{:04}.vtp\"", *number)) != std::string::npos))
            names_.insert(name);
    }
}

void RunFolder::refuse_other_runs() const {
    const Held held = holds();
    if (held == Held::nothing || held == Held::result) return;
    std::string ways = "choose another folder with -o, or replace it with --overwrite";
    if (!options_.resume_command.empty())
        ways = (held == Held::run ? "go on with --resume, "
                                  : "go on from it with --resume, where the recipes agree, ") +
               ways;
    throw RecipeError("{}: holds {} of {} recipe: {}", options_.output.string(),
                      held == Held::other_result ? "the result" : "an unfinished run",
                      held == Held::run ? "this" : "another", ways);
}

void RunFolder::begin(RunState& state) {
    if (!writes_) return;
    remove_partial_files(options_.output, names_);
    if (options_.resume && !goes_on_ && !options_.quiet && options_.warn)
        options_.warn(
            fmt::format("{}: holds no checkpoint yet: the run begins at time 0", options_.output.string()));
    if (goes_on_)
        go_on(state);
    else
        begin_anew();
}

// A program killed at any point in this function leaves an unfinished run, or nothing to resume.
void RunFolder::begin_anew() {
    const fs::path& folder = options_.output;
    if (!names_.empty() && !options_.refines) remove_records(folder / kAccuracyFolder);
    names_.insert(run_file_names().begin(), run_file_names().end());
    write_manifest(folder, names_);
    for (const char* first : {"summary.json", "checkpoint.vdb"}) remove_file(folder / first);
    write_file(folder / "recipe.toml", effective_);
    for (const std::string& name : names_)
        if (name != "recipe.toml") remove_file(folder / name);
    if (names_ == run_file_names()) return;
    names_ = run_file_names();
    write_manifest(folder, names_);
}

void RunFolder::go_on(RunState& state) {
    const fs::path& folder = options_.output;
    require_unchanged(state);
    if (!names_.empty()) refuse_foreign_files(true);
    cut_timeline(state);
    remove_file(folder / "summary.json");
    write_file(folder / "recipe.toml", effective_);
    for (auto name = names_.begin(); name != names_.end();) {
        const std::optional<std::size_t> number = saved_number(*name);
        const bool later = number && *number >= state.saved;
        if (later) remove_file(folder / *name);
        name = later ? names_.erase(name) : std::next(name);
    }
    names_.insert(run_file_names().begin(), run_file_names().end());
    for (const SavedFile& file : state.files) names_.insert(file.file);
    write_manifest(folder, names_);
    if (!state.files.empty()) write_pvd(state);
}

void RunFolder::refuse_changed(const char* name) const {
    throw FileError(
        "{}: is not what the run wrote before its checkpoint: bring it back, or remove it to go on without",
        (options_.output / name).string());
}

// Digest of the manifest's names as of the time when \p saved surfaces had been saved.
std::string RunFolder::digest_of_names(std::size_t saved) const {
    std::string text;
    for (const std::string& name : names_)
        if (const auto number = saved_number(name); !number || *number < saved) text += name + "\n";
    return digest(text);
}

void RunFolder::require_unchanged(const RunState& state) const {
    if (is_there(options_.output / kManifest) && !state.manifest.empty() &&
        digest_of_names(state.saved) != state.manifest)
        refuse_changed(kManifest);
    if (!is_there(timeline()) || state.timeline.empty()) return;
    const std::string text = surface::read_whole_file(timeline());
    if (digest(text.substr(0, row_ends(text, state.rows + 1).back())) != state.timeline)
        refuse_changed("timeline.csv");
}

// Cuts the timeline to its header and the rows before the checkpoint; if a step ended there, appends its
// end row.
void RunFolder::cut_timeline(RunState& state) const {
    const std::size_t rows = state.rows;
    if (rows == 0 && state.end_row.empty()) return remove_file(timeline());
    const std::string text = is_there(timeline()) ? surface::read_whole_file(timeline()) : "";
    const std::vector<std::size_t> ends = row_ends(text, rows + 1);
    std::string kept = text.substr(0, ends.back());
    const std::size_t lines = ends.size() - 1;
    if (lines <= rows) {
        state.rows = lines == 0 ? 0 : lines - 1;
        if (options_.warn)
            options_.warn(fmt::format("{}: lacks {} of the {} rows before the checkpoint",
                                      timeline().string(), rows - state.rows, rows));
    }
    if (lines == 0)
        state.end_row.clear();  // the header, which names its columns, is gone
    else if (!state.end_row.empty())
        kept += state.end_row + "\n";
    if (kept != text) write_file(timeline(), kept);
}

void RunFolder::revise(RunState& state) {
    effective_ = effective_recipe(recipe_);
    std::set<std::string> added = input_paths(recipe_);  // the others stay as the run has read them
    for (const InputFile& file : state.inputs) added.erase(file.path);
    std::ranges::move(input_files(added), std::back_inserter(state.inputs));
    if (writes_) write_file(options_.output / "recipe.toml", effective_);
    checkpoint(state);
}

// If files are removed during the run (`rm -r`), stops rather than fill a folder that lacks the others.
void RunFolder::require_there() const {
    for (const char* name : {"recipe.toml", kManifest})
        if (!is_there(options_.output / name))
            throw IoError("{}: was removed while the run went on: start it again",
                          (options_.output / name).string());
}

// Lists files in the manifest before they are made.
void RunFolder::list(std::vector<std::string> names) {
    std::erase_if(names, [&](const std::string& name) { return !names_.insert(name).second; });
    add_to_manifest(options_.output, names);
}

bool RunFolder::due(const RunState& state) const {
    if (const auto& every = recipe_.output.every)
        return state.reached(state.next_save(*every) - kSameTime * *every);
    return state.begins_step() && !state.is_saved();
}

void RunFolder::save(RunState& state, const Model& model, const TracedSurface& surface,
                     const std::string& after) {
    const PhaseClock clock(state.timing.output);
    if (writes_) {
        require_there();
        write_meshes(state, model, surface, after);
    }
    ++state.saved;
    state.stacks.push_back({state.process_time(), state.step, layer_materials(state.stack)});
    if (writes_) write_pvd(state);
}

void RunFolder::write_meshes(RunState& state, const Model& model, const TracedSurface& surface,
                             const std::string& after) {
    const auto meta = metadata_of(recipe_, state.process_time());
    int part = 0;
    const auto write = [&](const std::string& name, TriangleMesh mesh) {
        widen_to_strip(recipe_, mesh);
        if (part == 0) write_profiles(mesh, state.saved);  // of the surface, so that `export` gives the same
        surface::write_mesh(options_.output / name, mesh, meta);
        state.files.push_back({state.process_time(), part++, name, after});
    };
    const std::string number = fmt::format("{:04}", state.saved);
    levelset::StackMeshes meshes = levelset::extract_materials(state.stack, surface.raw);
    std::vector<std::string> names{"surface_" + number + ".vtp"};
    for (std::size_t k = 0; k < meshes.interfaces.size(); ++k)
        if (!meshes.interfaces[k].triangles.empty())
            names.push_back(fmt::format("interface_{}_{}.vtp", number, k));
    if (surface.simplified) names.push_back("traced_" + number + ".vtp");
    for (std::size_t k = 0; k < recipe_.output.profiles.size(); ++k) names.push_back(profile_name(number, k));
    list(names);
    write("surface_" + number + ".vtp", result_mesh(model, state.stack, surface, std::move(meshes.surface)));
    for (std::size_t k = 0; k < meshes.interfaces.size(); ++k) {
        TriangleMesh mesh = interface_mesh(std::move(meshes.interfaces[k]), state.stack.layers[k].material);
        if (!mesh.triangles.empty()) write(fmt::format("interface_{}_{}.vtp", number, k), std::move(mesh));
    }
    if (surface.simplified) write("traced_" + number + ".vtp", traced_mesh(model, surface));
}

void RunFolder::write_profiles(const TriangleMesh& surface, std::size_t number) const {
    const auto planes = profile_planes(recipe_);
    for (std::size_t k = 0; k < planes.size(); ++k) {
        const std::string name = profile_name(fmt::format("{:04}", number), k);
        surface::write_whole_file(options_.output / name,
                                  surface::profile_csv(surface::cut_by_plane(surface, planes[k]), planes[k]));
    }
}

void RunFolder::write_pvd(const RunState& state) const {
    write_file(options_.output / "surface.pvd", pvd_text(state.files));
}

void RunFolder::record(RunState& state, const Step& step, const TracedSurface& surface,
                       const TimeStep& next) {
    const PhaseClock clock(state.timing.output);
    count_end_row(state);
    if (surface.arriving && surface.arriving->trace)
        add_noise(*surface.arriving->trace, next.dt, state.noise);
    if (writes_) {
        const std::vector<Measure> measures = measure(recipe_, state.stack, surface.raw);
        append_row(state, with_measures(timeline_row(state, step, surface, next), measures), measures);
    }
    ++state.rows;
}

void RunFolder::record_end(RunState& state, const Step& step, const TriangleMesh& surface,
                           const std::vector<Measure>& measures) {
    count_end_row(state);
    const std::string row = with_measures(timeline_end_row(state, step, surface), measures);
    if (writes_) append_row(state, row, measures);
    state.end_row = row;
}

void RunFolder::append_row(const RunState& state, const std::string& row,
                           const std::vector<Measure>& measures) const {
    require_there();
    const bool fresh = state.rows == 0 || !is_there(timeline());
    surface::append_to_file(timeline(), (fresh ? timeline_header(recipe_, measures) : "") + row + "\n");
}

void RunFolder::checkpoint(RunState& state) const {
    if (!writes_) return;
    require_there();
    const PhaseClock clock(state.timing.output);
    // The checkpoint counts the timeline's rows, so these must be on the disk first. A resumed run writes
    // later rows again. If it is unknown whether there is a timeline, opening it throws with the reason.
    std::error_code unknown;
    state.timeline.clear();
    if (fs::exists(timeline(), unknown) || unknown) {
        surface::sync_file(timeline());
        const std::string text = surface::read_back(timeline());
        state.timeline = digest(text.substr(0, row_ends(text, state.rows + 1).back()));
    }
    state.manifest = digest_of_names(state.saved);
    save_state(options_.output, recipe_, state);
}

Json RunFolder::finish(const RunState& state, const std::vector<Step>& steps, const TracedSurface& surface) {
    Json summary = summary_of(recipe_, state, steps, surface);
    if (options_.shares.ranks > 1)
        summary["ranks"] = Json{{"count", options_.shares.ranks}, {"seconds_in_sums", seconds_in_sums()}};
    if (!writes_) return summary;
    require_there();
    write_manifest(options_.output, names_);  // sorted
    write_json((options_.output / "summary.json").string(), summary);
    return summary;
}

bool holds_recipe(const fs::path& folder, const std::string& effective) {
    return is_there(folder / "recipe.toml") && surface::read_whole_file(folder / "recipe.toml") == effective;
}

}  // namespace sidewall::app
