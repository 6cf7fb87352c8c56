#include "app/process/run_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <string_view>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/process/saved_meshes.hpp"
#include "app/process/summary.hpp"
#include "app/results/metrology.hpp"
#include "surface/cut.hpp"
#include "surface/error.hpp"
#include "surface/file.hpp"
#include "surface/mesh_io.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

// The text less `start` and the digits that follow it, of which there must be at least \p digits.
std::optional<std::string_view> after_number(std::string_view text, std::string_view start,
                                             std::size_t digits) {
    if (!text.starts_with(start)) return std::nullopt;
    text.remove_prefix(start.size());
    const std::size_t count = std::min(text.size(), text.find_first_not_of("0123456789"));
    if (count < digits) return std::nullopt;
    return text.substr(count);
}

// Everything a run writes but its recipe, so that a new one leaves nothing of an old one behind.
bool is_ours(std::string_view name) {
    for (const char* whole : {"summary.json", "timeline.csv", "surface.pvd", "checkpoint.vdb"})
        if (name == whole) return true;
    for (const char* mesh : {"surface_", "traced_"})
        if (after_number(name, mesh, 4) == ".vtp") return true;
    if (const auto rest = after_number(name, "profile_", 4))
        return rest == ".csv" || after_number(*rest, "_", 1) == ".csv";
    if (const auto rest = after_number(name, "interface_", 4)) return after_number(*rest, "_", 1) == ".vtp";
    return false;
}

// The user's own recipe must not be replaced by the effective one, which has no comments.
void spare_recipe(const std::string& file, const fs::path& copy, const std::string& effective) {
    std::error_code failure;
    if (fs::equivalent(file, copy, failure) && surface::read_whole_file(copy) != effective)
        throw RecipeError(fmt::format(
            "{}: the run would write its effective recipe over this file: choose another folder with -o",
            file));
}

std::string timeline_header(const Recipe& recipe, const std::vector<Measure>& measures) {
    const auto& length = recipe.domain.length_unit;
    const auto& time = recipe.domain.time_unit;
    std::string header = fmt::format(
        "step,name,time [{0}],dt [{0}],max_speed [{1}/{0}],raw_vertices,raw_triangles,simplified_vertices,"
        "simplified_triangles,segments,leaked,relative_error",
        time, length);
    for (const Measure& m : measures) header += fmt::format(",{} [{}]", m.name, m.unit);
    return header + "\n";
}

// A CSV field: quoted if its text asks for it.
std::string field(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
    return quoted + "\"";
}

}  // namespace

RunFolder::RunFolder(const RunOptions& options, const Recipe& recipe, const RunState& state)
    : options_(options), recipe_(recipe) {
    make_folder(options.output, "choose another with -o");
    std::error_code failure;
    const fs::path timeline = options.output / "timeline.csv", copy = options.output / "recipe.toml";
    const std::string effective = effective_recipe(recipe);
    spare_recipe(recipe.file, copy, effective);
    if (!options.resume) {
        for (const auto& entry : fs::directory_iterator(options.output))
            if (is_ours(entry.path().filename().string())) fs::remove(entry.path(), failure);
    } else if (std::ifstream in(timeline); in) {
        std::string kept, line;
        for (std::size_t row = 0; row <= state.rows && std::getline(in, line); ++row) kept += line + "\n";
        write_file(timeline, kept);
    }
    write_file(copy, effective);
}

bool RunFolder::due(const RunState& state) const {
    if (recipe_.output.every) return state.time >= static_cast<double>(state.saved) * *recipe_.output.every;
    return state.time == state.step_start;
}

void RunFolder::save(RunState& state, const Model& model, const TracedSurface& surface) {
    {
        const PhaseClock clock(state.timing.output);
        write_meshes(state, model, surface);
        write_profiles(surface.raw, state.saved);
        ++state.saved;
        write_pvd(state);
    }
    checkpoint(state);
}

void RunFolder::write_meshes(RunState& state, const Model& model, const TracedSurface& surface) const {
    const auto meta = metadata_of(recipe_, state.time);
    int part = 0;
    const auto write = [&](const std::string& name, const TriangleMesh& mesh) {
        surface::write_mesh(options_.output / name, mesh, meta);
        state.files.push_back({state.time, part++, name});
    };
    const std::string number = fmt::format("{:04}", state.saved);
    write("surface_" + number + ".vtp", result_mesh(model, state.stack, surface));
    for (std::size_t k = 0; k + 1 < state.stack.layers.size(); ++k) {
        const TriangleMesh mesh = interface_mesh(state.stack, k);
        if (!mesh.triangles.empty()) write(fmt::format("interface_{}_{}.vtp", number, k), mesh);
    }
    if (surface.simplified) write("traced_" + number + ".vtp", traced_mesh(model, surface));
}

void RunFolder::write_profiles(const TriangleMesh& surface, std::size_t number) const {
    const auto planes = profile_planes(recipe_);
    for (std::size_t k = 0; k < planes.size(); ++k) {
        const std::string name = k == 0 ? fmt::format("profile_{:04}.csv", number)
                                        : fmt::format("profile_{:04}_{}.csv", number, k);
        surface::write_profile_csv(options_.output / name, surface::cut_by_plane(surface, planes[k]),
                                   planes[k]);
    }
}

void RunFolder::write_pvd(const RunState& state) const {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const SavedFile& file : state.files)
        text += fmt::format("    <DataSet timestep=\"{}\" part=\"{}\" file=\"{}\"/>\n", file.time, file.part,
                            file.name);
    write_file(options_.output / "surface.pvd", text + "  </Collection>\n</VTKFile>\n");
}

void RunFolder::record(RunState& state, const Step& step, const TracedSurface& surface,
                       const TimeStep& next) {
    const PhaseClock clock(state.timing.output);
    const auto& traced = surface.traced();
    std::uint64_t segments = 0, leaked = 0;
    double error = 0.0;
    // Fluxes of an earlier time step have no error of their own.
    const bool reused = surface.arriving && !surface.arriving->trace;
    if (surface.arriving && surface.arriving->trace)
        for (const flux::FluxResult& flux : surface.arriving->trace->species) {
            if (flux.pass_place == 0) segments += flux.segments;
            leaked += flux.leaked;
            error = std::max(error, flux.relative_error);
        }
    std::string row =
        fmt::format("{},{},{:.9g},{:.9g},{:.9g},{},{},{},{},{},{},{}", state.step + 1, field(step.name),
                    state.time, next.dt, next.speed, surface.raw.vertices.size(),
                    surface.raw.triangles.size(), traced.vertices.size(), traced.triangles.size(), segments,
                    leaked, reused ? std::string() : fmt::format("{:.6g}", error));
    const std::vector<Measure> measures = measure(recipe_, state.stack, surface.raw);
    for (const Measure& m : measures)  // none of something that is not there
        row += std::isfinite(m.value) ? fmt::format(",{:.9g}", m.value) : ",";
    append_to_file(options_.output / "timeline.csv",
                   (state.rows == 0 ? timeline_header(recipe_, measures) : "") + row + "\n");
    ++state.rows;
}

void RunFolder::checkpoint(const RunState& state) const {
    save_state(options_.output, recipe_, state);
}

Json RunFolder::finish(const RunState& state, const std::vector<Step>& steps,
                       const TracedSurface& surface) const {
    Json summary = summary_of(recipe_, state, steps, surface);
    write_json((options_.output / "summary.json").string(), summary);
    return summary;
}

}  // namespace sidewall::app
