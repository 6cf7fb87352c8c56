#include "app/process/record/summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/common/json.hpp"
#include "app/common/processes.hpp"
#include "app/common/text.hpp"
#include "app/common/version.hpp"
#include "app/process/arriving/flux_methods.hpp"
#include "app/process/noise.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/results/cut_profile.hpp"
#include "levelset/layers/levels.hpp"
#include "surface/files/vtk_writer.hpp"

namespace sidewall::app {
namespace {

// Significant digits of figures. Times are exact; a front is known to about a thousandth of a grid spacing.
constexpr int kTimeDigits = 9, kDigits = 6, kErrorDigits = 4;

// Volume changes below a shift of the whole surface by this share of a grid spacing count as rounding.
constexpr double kLeastShift = 1e-6;

double wafer_area(const levelset::Domain& domain) {
    if (domain.axial) return std::numbers::pi * domain.max[0] * domain.max[0];
    return (domain.max[0] - domain.min[0]) * (domain.max[1] - domain.min[1]);
}

double settled(double volume, const levelset::Domain& domain) {
    return std::abs(volume) < kLeastShift * domain.spacing * wafer_area(domain) ? 0.0 : volume;
}

Json seconds_json(const Timing& timing) {
    Json json = timing;
    for (Json& seconds : json) seconds = number_or_null(seconds.get<double>(), kErrorDigits);
    return json;
}

// Mean rate of the whole wafer over a time: positive for growth, negative for etching; NaN if the time is 0.
double mean_rate(double grown, const levelset::Domain& domain, double time) {
    return settled(grown, domain) / (wafer_area(domain) * time);
}

Json steps_json(const std::vector<Step>& steps, const RunState& state) {
    const auto share = [](const std::optional<double>& bare) {
        return number_or_null(bare.value_or(kNone), kErrorDigits);
    };
    Json list = Json::array();
    for (std::size_t k = 0; k < steps.size(); ++k) {
        const StepEnd& end = state.history.ends[k];
        Json step{
            {"name", steps[k].name},
            {"model", steps[k].model},
            {"asked_duration", number_or_null(steps[k].duration, kTimeDigits)},
            {"duration", number_or_null(end.duration, kTimeDigits)},
            {"time", number_or_null(end.time, kTimeDigits)},
            {"stopped_by", end.stopped_by},
            {"mean_rate", number_or_null(mean_rate(end.grown, state.stack.domain, end.duration), kDigits)},
            {"time_steps", state.time_steps[k]},
            {"measures", Json::object()}};
        if (!steps[k].chemistry.empty()) step["chemistry"] = steps[k].chemistry;
        if (end.has_stop)
            step["endpoint"] = {{"time", number_or_null(end.endpoint.value_or(kNone), kTimeDigits)},
                                {"bare", share(end.endpoint_bare)},
                                {"over_etch", number_or_null(end.over_etch, kTimeDigits)}};
        if (end.bare) step["bare"] = share(end.bare);
        for (const Measure& m : end.measures)
            if (is_listed(m)) step["measures"][m.name] = number_or_null(m.value, kDigits);
        list.push_back(std::move(step));
    }
    return list;
}

Json flux_json(const TracedSurface& surface) {
    Json list = Json::array();
    if (!surface.arriving || !surface.arriving->trace) return list;
    const TraceReport& trace = *surface.arriving->trace;
    for (std::size_t k = 0; k < trace.species.size(); ++k) {
        const flux::FluxResult& flux = trace.species[k];
        const SpeciesMethod& method = trace.methods[k];
        list.push_back(Json{{"species", method.species},
                            {"method", method_name(method)},
                            {"rays", flux.emitted},
                            {"segments", flux.segments},
                            {"pass_species", flux.pass_species},
                            {"pass_place", flux.pass_place},
                            {"leaked", flux.leaked},
                            {"relative_error", number_or_null(flux.relative_error, kErrorDigits)}});
        if (flux.redeposition_error > 0.0)
            list.back()["redeposition_error"] = number_or_null(flux.redeposition_error, kErrorDigits);
        if (flux.adjoint) list.back()["bottom_up"] = true;
        if (method.radiosity)
            list.back()["discretisation_error"] = number_or_null(flux.discretisation_error, kErrorDigits);
        if (!method.reason.empty()) list.back()["reason"] = method.reason;
    }
    return list;
}

// Adds all events, and the vanished materials also in a list apart.
void add_events(const Recipe& recipe, const std::vector<Step>& steps, const History& history, Json& summary) {
    summary["events"] = summary["vanished"] = Json::array();
    for (const Event& event : history.events) {
        Json json{{"kind", event.kind},
                  {"time", number_or_null(event.time, kTimeDigits)},
                  {"step", event.step + 1},
                  {"name", steps.at(event.step).name}};
        if (!event.material.empty()) json["material"] = event.material;
        if (event.kind == kVanished) {
            summary["vanished"].push_back(
                Json{{"material", event.material}, {"time", json["time"]}, {"step", json["step"]}});
        } else {
            for (int axis = 0; axis < 3; ++axis)
                json["at"].push_back(number_or_null(event.at[axis], kDigits));
            if (event.kind == kDetached || event.kind == kVoidClosed) {
                json["count"] = event.count;
                json["volume"] = number_or_null(event.volume / volume_divisor(recipe), kDigits);
            }
        }
        summary["events"].push_back(std::move(json));
    }
}

// Adds the volumes of all materials that ever were on the wafer, and their net changes as measures.
void add_volumes(const Recipe& recipe, const RunState& state, Json& summary, std::vector<Measure>& measures) {
    const History& history = state.history;
    const std::string &length = recipe.domain.length_unit, &time = recipe.domain.time_unit;
    std::vector<double> last(recipe.materials.size(), 0.0);
    for (std::size_t k = 0; k < history.layer_volumes.size(); ++k)
        last[static_cast<std::size_t>(history.layer_materials[k])] += history.layer_volumes[k];
    const levelset::Domain& domain = state.stack.domain;
    summary["volumes"] = Json::object();
    const std::string unit = volume_unit(recipe);
    const double width = volume_divisor(recipe);
    summary["volume_unit"] = unit;
    double grown = 0.0;
    for (std::size_t m = 0; m < last.size(); ++m) {
        const double change = last[m] - history.initial[m],
                     possible = history.added[m] == 0.0 ? std::min(0.0, change) : change,
                     net = settled(possible, domain) / width;
        grown += change;
        // A substrate up to z = 0 is on the wafer, too, though its volume above z = 0 is none.
        if (history.initial[m] == 0.0 && history.added[m] == 0.0 &&
            std::ranges::count(history.layer_materials, static_cast<int>(m)) == 0)
            continue;
        const std::string& name = recipe.materials[m].name;
        measures.push_back({"added_volume_" + name, std::max(0.0, net), unit});
        measures.push_back({"removed_volume_" + name, std::max(0.0, -net), unit});
        summary["volumes"][name] =
            Json{{"net", number_or_null(net, kDigits)},
                 {"gross_added", number_or_null(settled(history.added[m], domain) / width, kDigits)},
                 {"gross_removed",
                  number_or_null(std::max(0.0, settled(history.removed[m], domain)) / width, kDigits)}};
    }
    if (state.process_time() > 0.0)
        measures.push_back(
            {"mean_rate", mean_rate(grown, domain, state.process_time()), length + "/" + time});
}

// The grid's levels at the end of the run, the finest first.
Json grid_json(const levelset::MaterialStack& stack) {
    Json levels = Json::array();
    const std::vector<std::size_t> voxels = levelset::voxels_by_level(stack);
    double spacing = stack.domain.spacing;
    for (std::size_t n = 0; n < voxels.size(); ++n, spacing *= 2.0)
        levels.push_back({{"spacing", number_or_null(spacing, kTimeDigits)}, {"voxels", voxels[n]}});
    return {{"levels", std::move(levels)}};
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
                 {"grid_spacing", number_or_null(state.stack.domain.spacing, kTimeDigits)},
                 {"grid", grid_json(state.stack)},
                 {"time", number_or_null(state.process_time(), kTimeDigits)},
                 {"time_steps", state.time_step},
                 {"steps", steps_json(steps, state)},
                 {"timing", seconds_json(state.timing)},
                 {"mesh",
                  {{"raw", mesh_sizes(surface.raw)},
                   {"simplified", mesh_sizes(surface.traced())},
                   {"coarsened", surface.simplified.has_value()}}},
                 {"flux", flux_json(surface)},
                 {"metrology", Json::object()},
                 {"metrology_units", Json::object()}};
    if (const auto reached = noise_reached(recipe, steps, state.history.ends);
        reached && recipe.flux.by_accuracy())
        summary["noise"] = {{"asked", recipe.flux.accuracy},
                            {"reached", number_or_null(*reached, kErrorDigits)}};
    add_events(recipe, steps, state.history, summary);
    std::vector<Measure> measures = measure(recipe, state.stack, surface.raw);
    add_volumes(recipe, state, summary, measures);
    for (const Measure& m : measures) {
        if (!is_listed(m)) continue;
        summary["metrology"][m.name] = number_or_null(m.value, kDigits);
        summary["metrology_units"][m.name] = m.unit;
    }
    if (surface.arriving && surface.arriving->trace && !surface.arriving->coverage.empty())
        summary["coverage"] =
            Json{{"traces", surface.arriving->trace->traces},
                 {"mean_change", number_or_null(surface.arriving->trace->coverage_change, kErrorDigits)}};
    return summary;
}

std::string timeline_header(const Recipe& recipe, const std::vector<Measure>& measures) {
    const auto& length = recipe.domain.length_unit;
    const auto& time = recipe.domain.time_unit;
    std::string header = fmt::format(
        "step,name,time [{0}],dt [{0}],max_speed [{1}/{0}],raw_vertices,raw_triangles,simplified_vertices,"
        "simplified_triangles,segments,leaked,relative_error",
        time, length);
    for (const Measure& m : measures) header += "," + csv_field(fmt::format("{} [{}]", m.name, m.unit));
    return header + "\n";
}

std::string timeline_row(const RunState& state, const Step& step, const TracedSurface& surface,
                         const TimeStep& next) {
    const auto& traced = surface.traced();
    std::uint64_t segments = 0, leaked = 0;
    double error = 0.0;
    // Fluxes reused from an earlier time step come without errors.
    const bool reused = surface.arriving && !surface.arriving->trace;
    if (surface.arriving && surface.arriving->trace)
        for (const flux::FluxResult& flux : surface.arriving->trace->species) {
            if (flux.pass_place == 0) segments += flux.segments;
            leaked += flux.leaked;
            error = std::max(error, flux.relative_error);
        }
    return fmt::format("{},{},{:.9g},{:.9g},{:.9g},{},{},{},{},{},{},{}", state.step + 1,
                       csv_field(step.name), state.process_time(), next.dt, next.speed,
                       surface.raw.vertices.size(), surface.raw.triangles.size(), traced.vertices.size(),
                       traced.triangles.size(), segments, leaked,
                       reused ? std::string() : fmt::format("{:.6g}", error));
}

std::string timeline_end_row(const RunState& state, const Step& step, const TriangleMesh& surface) {
    return fmt::format("{},{},{:.9g},,,{},{},,,,,", state.step + 1, csv_field(step.name),
                       state.process_time(), surface.vertices.size(), surface.triangles.size());
}

std::vector<std::size_t> row_ends(const std::string& text, std::size_t most) {
    std::vector<std::size_t> ends{0};
    bool quoted = false;  // step names may hold line breaks in files of old versions
    for (std::size_t at = 0; at < text.size() && ends.size() <= most; ++at) {
        if (text[at] == '"') quoted = !quoted;
        if (text[at] == '\n' && !quoted) ends.push_back(at + 1);
    }
    return ends;
}

std::string pvd_text(const std::vector<SavedFile>& files) {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const SavedFile& file : files)
        text += fmt::format("    <DataSet timestep=\"{}\" part=\"{}\" file=\"{}\" after=\"{}\"/>\n",
                            file.time, file.part, file.file, surface::xml_escape(file.after));
    return text + "  </Collection>\n</VTKFile>\n";
}

}  // namespace sidewall::app
