#include "simplify/simplify.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/common/timing.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/quality.hpp"
#include "surface/repair.hpp"

namespace sidewall::app {
namespace {

struct SimplifyArguments {
    std::string input, output, method = "region-bounded", json, feature_parameter = "0.5", weights;
    simplify::Options options;
};

simplify::Weights parse_weights(const std::string& text) {
    const std::vector<std::string> parts = split(text, ',');
    std::vector<double> values;
    for (const std::string& part : parts)
        if (const auto value = finite_number(part)) values.push_back(*value);
    if (values.size() != 3 || parts.size() != 3)
        throw RecipeError("--weights '{}': must be three numbers V,B,S, such as 0.5,0.5,0", text);
    return {values[0], values[1], values[2]};
}

/// The number of --feature-parameter, or what `auto` finds for the mesh.
double feature_parameter(const SimplifyArguments& arguments, const surface::Curvature& curvature,
                         double spacing) {
    const std::string& text = arguments.feature_parameter;
    if (text == "auto") return surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing);
    const std::optional<double> value = finite_number(text);
    if (!value || !(*value > 0.0))
        throw RecipeError("--feature-parameter {}: must be a positive number or auto", text);
    return *value;
}

Json one_way(const surface::Distance& distance) {
    return {{"max", distance.max}, {"mean", distance.mean}};
}

Json report(const SimplifyArguments& arguments, const TriangleMesh& mesh, const simplify::Result& result,
            double grid_spacing) {
    const surface::TwoSidedDistance distance = surface::two_sided_distance(mesh, result.mesh);
    const surface::Quality quality = surface::measure_quality(result.mesh);
    Json json;
    json["method"] = arguments.method;
    json["input"] = mesh_sizes(mesh);
    json["output"] = mesh_sizes(result.mesh);
    json["grid_spacing"] = grid_spacing;
    json["seconds"] = {{"features", result.seconds.features},
                       {"collapse", result.seconds.collapse},
                       {"total", result.seconds.total}};
    json["hausdorff"] = {{"original_to_simplified", one_way(distance.forward)},
                         {"simplified_to_original", one_way(distance.backward)}};
    json["quality"] = {{"min_angle_deg", quality.min_angle_deg}, {"mean_ratio_min", quality.mean_ratio_min}};
    json["rings"] = Json::array();
    for (const simplify::PassReport& pass : result.passes)
        json["rings"].push_back({{"length", pass.length}, {"removed", pass.removed}});
    json["dropped_attributes"] = result.dropped_attributes;
    return json;
}

void print_summary(const Json& json, const SimplifyArguments& arguments) {
    const auto n = json["input"]["vertices"].get<double>(), left = json["output"]["vertices"].get<double>();
    const auto number = [&](const char* group, const char* key) { return json[group][key].get<double>(); };
    print_plain("{}: {:.0f} vertices, {:.0f} triangles\n", arguments.input, n, number("input", "triangles"));
    print_plain("{}: {:.0f} vertices, {:.0f} triangles ({}, {:.1f} % of the vertices removed)\n",
                arguments.output, left, number("output", "triangles"), arguments.method,
                100.0 * (1.0 - left / n));
    print_plain("grid spacing     {:.4g}{}\n", json["grid_spacing"],
                arguments.options.grid_spacing ? "" : "  (estimated: mean edge length)");
    for (const char* way : {"original_to_simplified", "simplified_to_original"})
        print_plain("distance         max {:.3g}, mean {:.3g}  ({})\n", json["hausdorff"][way]["max"],
                    json["hausdorff"][way]["mean"], way);
    print_plain("quality          smallest angle {:.2f} degrees, smallest mean ratio {:.3f}\n",
                number("quality", "min_angle_deg"), number("quality", "mean_ratio_min"));
    print_plain("seconds          features {:.3f}, collapse {:.3f}, total {:.3f}\n",
                number("seconds", "features"), number("seconds", "collapse"), number("seconds", "total"));
    if (const auto count = json["features"]["count"].get<std::size_t>(); json["features"]["parameter"] > 0.0)
        print_plain("features         {} vertices, C = {:.3g}\n", count, json["features"]["parameter"]);
    for (const auto& [key, what] :
         {std::pair{"dropped_on_reading", "of the input file"}, {"dropped_attributes", "attributes"}})
        for (const Json& name : json[key])
            print_plain("dropped          {} ({})\n", name.get<std::string>(), what);
    print_plain("Lengths are in the mesh's own unit.\n");
}

void run(const SimplifyArguments& arguments) {
    simplify::Options options = arguments.options;
    options.method = simplify::method_from_string(arguments.method);
    if (!arguments.weights.empty()) options.weights = parse_weights(arguments.weights);
    surface::MeshMetadata metadata;
    TriangleMesh mesh = surface::read_mesh(arguments.input, &metadata);
    const std::string words = surface::repair_summary(surface::repair(mesh, {.face_gas = false}));
    if (!words.empty()) print_warning(fmt::format("sidewall simplify: {}: {}", arguments.input, words));

    const double start = now();
    const double spacing = simplify::base_length(mesh, {}, options.grid_spacing);
    std::vector<std::uint8_t> features;
    double parameter = 0.0;
    if (simplify::reads_features(options.method)) {
        const surface::Curvature curvature = surface::mesh_curvature(mesh);
        parameter = feature_parameter(arguments, curvature, spacing);
        features = surface::feature_flags(curvature, spacing, parameter);
    }
    const double features_found = now();
    const std::size_t target = std::min(options.target_vertices.value_or(0), mesh.vertices.size());
    ProgressBar progress("simplify", static_cast<double>(mesh.vertices.size() - target), "vertices",
                         arguments.json != "-");
    options.progress = [&](std::size_t left) {
        progress.update(static_cast<double>(mesh.vertices.size() - left));
    };
    simplify::Result result = simplify::simplify(mesh, features, options);
    result.seconds.features = features_found - start;
    result.seconds.total = now() - start;

    // Attributes that the file format cannot hold are dropped when the mesh is written.
    for (const std::string& name : surface::unwritable(arguments.output, result.mesh))
        result.dropped_attributes.push_back(name);
    Json json = report(arguments, mesh, result, spacing);
    json["features"] = {{"count", std::count(features.begin(), features.end(), 1)}, {"parameter", parameter}};
    json["dropped_on_reading"] = metadata.dropped;
    surface::write_mesh(arguments.output, result.mesh, metadata);
    if (!arguments.json.empty()) write_json(arguments.json, json);
    if (arguments.json != "-") print_summary(json, arguments);
}

}  // namespace

void add_simplify_command(CLI::App& program) {
    CLI::App& command =
        *program.add_subcommand("simplify",
                                "Coarsens a surface mesh, its features less than its flat parts.\n"
                                "Lengths are in the mesh's own unit.");
    const auto a = std::make_shared<SimplifyArguments>();
    add_option(command, "mesh", a->input, "MESH", "Input mesh: .vtp, .ply, .stl, .obj", {.required = true});
    add_option(command, "-o,--output", a->output, "MESH", "Output mesh, same formats", {.required = true});
    add_option(command, "--method", a->method,
               "{none,lindstrom-turk,region,region-bounded,cgal-lindstrom-turk}",
               "How edges to collapse are chosen (default: region-bounded)");
    add_option(command, "--l0", a->options.l0, "LENGTH",
               "Edges shorter than this collapse everywhere, features included; 0 leaves features alone "
               "(length; default: --grid-spacing if given, else the mean edge length between features)");
    add_option(command, "--step", a->options.step, "LENGTH",
               "Increase of the allowed edge length, --l0 at features, per ring away from them (length; "
               "default: as --l0's default)");
    add_option(command, "--l-max", a->options.l_max, "LENGTH",
               "Edges longer than this never collapse (length; default: regions 3, lindstrom-turk 2 times "
               "--l0's default; lindstrom-turk with a target: none)");
    add_option(command, "--weights", a->weights, "V,B,S",
               "Lindstrom-Turk weights of volume, boundary and shape (default: 0.5,0.5,0; 0.4,0.3,0.3 gives "
               "rounder triangles at a larger distance)");
    add_option(command, "--max-error", a->options.max_error, "LENGTH",
               "Hard bound on the distance between input and output, both ways, at their vertices "
               "(length; default: region-bounded without a target 0.05 times --l0's default, else "
               "none; not for cgal-lindstrom-turk)");
    add_option(command, "--target-vertices", a->options.target_vertices, "N",
               "Stop at this many vertices; a region schedule then goes on beyond --l-max (default: none)",
               {.range = {{1, 1e15}}});
    add_option(command, "--feature-parameter", a->feature_parameter, "C|auto",
               "C: a vertex is a feature if its mean curvature |H| > C/dx or its Gaussian curvature |K| > "
               "(C/dx)^2, dx the grid spacing; auto: from the distribution of curvature (default: 0.5)");
    add_option(command, "--grid-spacing", a->options.grid_spacing, "LENGTH",
               "dx of the level set the mesh was extracted from (length; default: mean edge length)");
    add_option(command, "--json", a->json, "FILE", "Report as JSON to a file, or - for standard output");
    command.callback([a] { about(a->input, [&] { run(*a); }); });
}

}  // namespace sidewall::app
