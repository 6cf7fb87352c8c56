#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "app/devices/revolved.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/results/metrology.hpp"
#include "app/results/result.hpp"
#include "surface/files/file.hpp"
#include "surface/quality.hpp"
#include "surface/repair.hpp"
#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

Json vector_json(const Vec3& v) {
    return Json::array({v.x(), v.y(), v.z()});
}

Json attribute_json(const Attribute& attribute, const char* where) {
    double low = kInfinity, high = -low;
    std::size_t odd = 0;
    for (const double v : attribute.values) {
        if (!std::isfinite(v)) {
            ++odd;
            continue;
        }
        low = std::min(low, v);
        high = std::max(high, v);
    }
    return {{"name", attribute.name},
            {"on", where},
            {"components", attribute.components},
            {"min", number_or_null(low)},
            {"max", number_or_null(high)},
            {"not_finite", odd}};
}

Json mesh_json(const TriangleMesh& mesh) {
    const surface::Topology topology = surface::analyse_topology(mesh);
    const surface::Quality quality = surface::measure_quality(mesh);
    const Box3 box = bounding_box(mesh);
    Json json;
    json["vertices"] = mesh.vertices.size();
    json["triangles"] = mesh.triangles.size();
    json["box"] = {{"min", vector_json(box.min)}, {"max", vector_json(box.max)}};
    json["area"] = total_area(mesh);
    if (topology.closed()) json["volume"] = enclosed_volume(mesh);
    json["topology"] = {{"components", topology.components},
                        {"euler", topology.euler()},
                        {"closed", topology.closed()},
                        {"boundary_edges", topology.boundary_edges},
                        {"boundary_loops", topology.boundary_loops.size()},
                        {"boundary_on_rectangle", surface::boundary_on_rectangle(mesh, topology)},
                        {"manifold", topology.manifold()},
                        {"nonmanifold_edges", topology.nonmanifold_edges},
                        {"nonmanifold_vertices", topology.nonmanifold_vertices},
                        {"inconsistent_edges", topology.inconsistent_edges},
                        {"duplicate_triangles", topology.duplicate_triangles},
                        {"isolated_vertices", topology.isolated_vertices}};
    json["quality"] = {{"min_angle_deg", quality.min_angle_deg},
                       {"max_angle_deg", quality.max_angle_deg},
                       {"mean_ratio_min", quality.mean_ratio_min},
                       {"mean_ratio_mean", quality.mean_ratio_mean},
                       {"slivers", quality.slivers},
                       {"degenerate", quality.degenerate}};
    json["attributes"] = Json::array();
    for (const Attribute& a : mesh.vertex_attributes)
        json["attributes"].push_back(attribute_json(a, "vertices"));
    for (const Attribute& a : mesh.triangle_attributes)
        json["attributes"].push_back(attribute_json(a, "triangles"));
    return json;
}

/// What other commands repair when they read the mesh, or why they refuse it; "" if it needs no repair.
std::string repair_note(TriangleMesh mesh) {
    try {
        return surface::repair_summary(surface::repair(mesh));
    } catch (const GeometryError& error) {
        return std::string("refused: ") + error.what();
    }
}

void print_mesh(const Result& result, const Json& json) {
    const Json &topology = json["topology"], &quality = json["quality"], &box = json["box"];
    const std::string unit = metadata_text(result.metadata, "length_unit", "");
    print_plain("{}\n", result.source.string());
    print_plain("  size        {} vertices, {} triangles, area {:.6g}{}\n", json["vertices"],
                json["triangles"], json["area"], unit.empty() ? "" : " " + unit + "^2");
    for (int k = 0; k < 3; ++k)
        print_plain("  {}           {:.6g} to {:.6g}{}\n", "xyz"[k], box["min"][static_cast<std::size_t>(k)],
                    box["max"][static_cast<std::size_t>(k)], unit.empty() ? "" : " " + unit);
    for (const auto& [name, number] : result.metadata.numbers)
        print_plain("  {:<11} {:.6g}\n", surface::printable(name, true), number);
    if (topology["closed"].get<bool>())
        print_plain("  boundary    none: closed, volume {:.6g}\n", json["volume"]);
    else
        print_plain("  boundary    {} edges in {} loops, {}\n", topology["boundary_edges"],
                    topology["boundary_loops"],
                    topology["boundary_on_rectangle"].get<bool>() ? "on a rectangle" : "not on a rectangle");
    print_plain("  connected   {} component{}, Euler number {}\n", topology["components"],
                topology["components"].get<std::size_t>() == 1 ? "" : "s", topology["euler"]);
    std::string faults;
    for (const char* key : {"nonmanifold_edges", "nonmanifold_vertices", "inconsistent_edges",
                            "duplicate_triangles", "isolated_vertices"})
        if (const auto count = topology[key].get<std::size_t>(); count > 0) {
            std::string words = key;
            std::replace(words.begin(), words.end(), '_', ' ');
            faults += fmt::format("{}{} {}", faults.empty() ? "" : ", ", count, words);
        }
    print_plain("  faults      {}\n", faults.empty() ? "none: manifold, consistently oriented" : faults);
    if (const auto words = json["import"].get<std::string>(); !words.empty())
        print_plain("  import      {}\n", words);
    print_plain(
        "  quality     angles {:.3g} to {:.4g} degrees, mean ratio {:.3g} (least {:.3g}), {} slivers, {} "
        "degenerate\n",
        quality["min_angle_deg"], quality["max_angle_deg"], quality["mean_ratio_mean"],
        quality["mean_ratio_min"], quality["slivers"], quality["degenerate"]);
    for (const Json& a : json["attributes"]) {
        const auto odd = a["not_finite"].get<std::size_t>();
        print_plain("  attribute   {} on {}{}: {:.6g} to {:.6g}{}\n",
                    surface::printable(a["name"].get<std::string>(), true), a["on"],
                    a["components"] == 1 ? "" : fmt::format(" x {}", a["components"]), a["min"], a["max"],
                    odd == 0 ? "" : fmt::format(" ({} not finite)", odd));
    }
}

/// Prints any part of summary.json as indented lines.
void print_json(const std::string& key, const Json& json, int indent) {
    const std::string name = surface::printable(key, true);
    const std::string pad(static_cast<std::size_t>(indent), ' ');
    if (json.is_object()) {
        print_plain("{}{}\n", pad, name);
        for (const auto& [inner, value] : json.items()) print_json(inner, value, indent + 2);
    } else if (json.is_number_float()) {
        print_plain("{}{:<{}} {:.6g}\n", pad, name, 24 - indent, json.get<double>());
    } else {
        print_plain("{}{:<{}} {}\n", pad, name, 24 - indent,
                    surface::printable(json.is_string() ? json.get<std::string>() : json.dump(), true));
    }
}

void print_timing(const Json& timing) {
    const auto seconds = [](const Json& v) { return v.is_number() ? v.get<double>() : 0.0; };
    const double total = timing.contains("total") ? seconds(timing["total"]) : 0.0;
    print_plain("timing (seconds, share)\n");
    for (const auto& [phase, value] : timing.items())
        print_plain("  {:<14} {:>10.3f} {:>6.1f} %\n", surface::printable(phase, true), seconds(value),
                    total > 0.0 ? 100.0 * seconds(value) / total : 0.0);
}

void print_summary(const Json& summary) {
    if (!summary.is_object()) return;
    for (const char* key : {"version", "recipe", "seed", "threads"})
        if (summary.contains(key)) print_json(key, summary[key], 0);
    for (const char* list : {"steps", "events"}) {
        if (!summary.contains(list) || !summary[list].is_array()) continue;
        print_plain("{}\n", list);
        for (const Json& item : summary[list]) print_plain("  {}\n", surface::printable(item.dump(), true));
    }
    for (const char* part : {"mesh", "metrology", "volumes"})
        if (summary.contains(part)) print_json(part, summary[part], 0);
    if (summary.contains("timing") && summary["timing"].is_object()) print_timing(summary["timing"]);
}

/// Measures the chosen wafer: the figures in \p names or, if that is empty, those that the recipe asks for.
std::vector<Measure> measured(const Result& result, const std::string& input, const WaferChoice& choice,
                              const std::vector<std::string>& names) {
    if (!result.folder)
        throw RecipeError("{}: --measure needs the folder that `run` wrote, with its checkpoint.vdb", input);
    const fs::path folder = input;
    Recipe recipe = load_frame(folder / "recipe.toml");
    if (!names.empty()) recipe.metrology.measures.clear();
    for (const std::string& name : names) {
        if (word_of(recipe, name) == "")
            throw RecipeError("--measure {}: is recorded during a run; inspect prints it under metrology",
                              name);
        want_measure(recipe, name, "--measure");
    }
    std::optional<SavedSurface> saved;
    if (choice.named()) saved = saved_choice(folder, choice);
    return measure_saved(folder, recipe, saved, !names.empty());
}

Json measures_json(const std::vector<Measure>& measures) {
    Json json = Json::object();
    for (const Measure& m : measures)
        if (is_listed(m)) json[m.name] = {{"value", number_or_null(m.value, 6)}, {"unit", m.unit}};
    return json;
}

void print_measures(const std::vector<Measure>& measures) {
    print_plain("measures\n");
    for (const Measure& m : measures)
        print_plain("  {:<22} {}\n", m.name,
                    std::isfinite(m.value) ? fmt::format("{:.6g} {}", m.value, m.unit) : "none");
}

void inspect(const std::string& input, const std::string& json_file, const WaferChoice& choice,
             const std::vector<std::string>& names) {
    const Result result = read_choice(input, choice);
    const std::string unfinished = unfinished_note(input);
    const bool has_wafer = result.folder && is_there(*result.folder / "checkpoint.vdb");
    Json json;
    std::optional<std::vector<Measure>> measures;
    if (!names.empty() || ((choice.named() || !unfinished.empty()) && has_wafer))
        json["measures"] = measures_json(measures.emplace(measured(result, input, choice, names)));
    if (result.folder) json["finished"] = unfinished.empty();
    json["file"] = result.source.string();
    json["surface"] = mesh_json(result.surface);
    json["surface"]["import"] = repair_note(result.surface);
    if (is_round_profile(result.metadata)) json["surface"]["area"] = revolved_area(result.surface);
    for (const auto& [name, text] : result.metadata.texts) {
        json["metadata"][name] = text;
        if (text.find('\0') != std::string::npos) json["metadata"][name] = split(text, '\0');
    }
    for (const auto& [name, number] : result.metadata.numbers)
        json["metadata"][name] = number_or_null(number);
    if (result.folder) json["interfaces"] = result.interfaces.size();
    if (result.summary) json["summary"] = *result.summary;
    // Where the JSON goes to standard output, nothing else does.
    if (json_file != "-") {
        if (result.summary) print_summary(*result.summary);
        if (!unfinished.empty()) print_plain("{}\n", unfinished);
        print_mesh(result, json["surface"]);
        if (measures) print_measures(*measures);
        std::fflush(stdout);
    }
    if (!json_file.empty()) write_json(json_file, json);
}

}  // namespace

void add_inspect_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "inspect", "Print what a mesh or a run's folder holds: sizes, boundary, quality, metrology");
    auto input = std::make_shared<std::string>(), json = std::make_shared<std::string>();
    add_option(command, "input", *input, "MESH|DIR",
               "Mesh file (VTP, STL, PLY, OBJ) or folder that `run` wrote", {.required = true});
    auto names = std::make_shared<std::vector<std::string>>();
    add_repeated(
        command, "--measure", *names, fmt::format("{{{}}}", fmt::join(measure_names(), ",")),
        "For a run's folder: measure this at the run's end, or at --step or --time; a word of [metrology] "
        "measures or a figure such as cd_SiO2_at_0.5; may be repeated");
    add_option(command, "--json", *json, "FILE", "Write the same as JSON; - for standard output");
    auto choice = std::make_shared<WaferChoice>();
    add_choice_options(command, *choice);
    command.callback([=] { about(*input, [&] { inspect(*input, *json, *choice, *names); }); });
}

}  // namespace sidewall::app
