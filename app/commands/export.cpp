#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/timing.hpp"
#include "app/devices/device.hpp"
#include "app/devices/revolved.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "surface/cut.hpp"
#include "surface/files/file.hpp"
#include "surface/files/output_file.hpp"
#include "surface/tetrahedra/tet_io.hpp"

namespace sidewall::app {
namespace {

struct ExportArguments {
    std::string input, output, json, cut = "y=0";
    WaferChoice choice;
    bool triangles = false;
    int around = 64;
    DeviceOptions options;
};

enum class Kind { tetrahedra, surface, blocks, profile };

Kind kind_of(const ExportArguments& arguments) {
    const std::string extension = surface::lower_extension(arguments.output);
    const Kind kind = extension == ".vtu" || extension == ".msh" ? Kind::tetrahedra
                      : extension == ".vtm"                      ? Kind::blocks
                      : extension == ".csv"                      ? Kind::profile
                                                                 : Kind::surface;
    if (kind == Kind::surface && extension != ".stl" && extension != ".obj" && extension != ".ply" &&
        extension != ".vtp")
        throw RecipeError(
            "-o {}: must end in .vtu or .msh (tetrahedra), .stl, .obj, .ply or .vtp (the surface), .vtm (all "
            "surfaces) or .csv (a cut)",
            arguments.output);
    const DeviceOptions& options = arguments.options;
    if (kind != Kind::tetrahedra && (options.size || options.bottom || options.gas || arguments.triangles ||
                                     options.most != DeviceOptions{}.most))
        throw RecipeError(
            "-o {}: --size, --most, --bottom, --gas and --triangles are for tetrahedra: name a .vtu or .msh",
            arguments.output);
    return kind;
}

/// Refuses outputs that would replace a file of the run or each other.
void check_outputs(const ExportArguments& arguments, Kind kind) {
    const auto whole = [](const fs::path& path) {
        std::error_code none;
        return fs::weakly_canonical(fs::absolute(path), none);
    };
    const fs::path input = whole(arguments.input), output = whole(arguments.output);
    const bool has_json = !arguments.json.empty() && arguments.json != "-";
    const fs::path json = has_json ? whole(arguments.json) : fs::path();
    const fs::path blocks = output.parent_path() / output.stem();
    const auto refuse = [](const char* option, const std::string& file, const char* why) {
        throw RecipeError("{} {}: {}: choose another name", option, file, why);
    };
    if (output.parent_path() == input || (kind == Kind::blocks && blocks == input))
        refuse("-o", arguments.output, "would write among the run's own files");
    if (has_json && json.parent_path() == input)
        refuse("--json", arguments.json, "would write among the run's own files");
    if (has_json && json == output) refuse("--json", arguments.json, "is the file of -o, too");
    if (fs::is_directory(output)) refuse("-o", arguments.output, "is a folder");
}

Result read_input(const ExportArguments& arguments) {
    if (!fs::is_directory(arguments.input)) saved_surfaces(arguments.input);  // throws: not a run's folder
    if (const std::string note = unfinished_note(arguments.input); !note.empty()) print_warning(note);
    return read_choice(arguments.input, arguments.choice);
}

Json quality_json(const Device& device) {
    const TetQuality quality = measure_tets(device.mesh);
    Json json;
    json["vertices"] = device.mesh.vertices.size();
    json["tetrahedra"] = device.mesh.tetrahedra.size();
    json["triangles"] = device.mesh.triangles.size();
    json["size"] = device.size;
    json["bottom"] = device.bottom;
    if (device.drawn_out > 0.0) json["drawn_out"] = device.drawn_out;
    json["quality"] = {{"inverted", quality.inverted},
                       {"min_dihedral_deg", quality.least_dihedral_deg},
                       {"mean_min_dihedral_deg", quality.mean_least_dihedral_deg},
                       {"shortest_edge", quality.shortest_edge},
                       {"longest_edge", quality.longest_edge}};
    json["regions"] = Json::array();
    for (std::size_t r = 0; r < device.volume.size(); ++r)
        json["regions"].push_back({{"name", device.mesh.regions[r]},
                                   {"tetrahedra", quality.count[r]},
                                   {"volume", quality.volume[r]},
                                   {"volume_by_surfaces", device.volume[r]}});
    std::vector<std::size_t> triangles(device.mesh.boundaries.size());
    std::vector<double> area(triangles.size());
    for (std::size_t t = 0; t < device.mesh.triangles.size(); ++t) {
        const auto [a, b, c] = device.mesh.triangles[t];
        const auto& p = device.mesh.vertices;
        const auto boundary = static_cast<std::size_t>(device.mesh.boundary[t]);
        ++triangles[boundary];
        area[boundary] += 0.5 * (p[b] - p[a]).cross(p[c] - p[a]).norm();
    }
    json["boundaries"] = Json::array();
    for (std::size_t b = 0; b < triangles.size(); ++b)
        json["boundaries"].push_back(
            {{"name", device.mesh.boundaries[b]}, {"triangles", triangles[b]}, {"area", area[b]}});
    return json;
}

void print_device(const Json& json, const std::string& unit) {
    const Json& quality = json["quality"];
    print_plain(
        "{} tetrahedra, {} vertices, edges {:.3g} to {:.3g} {}, smallest angle between faces {:.1f} degrees\n",
        json["tetrahedra"], json["vertices"], quality["shortest_edge"], quality["longest_edge"], unit,
        quality["min_dihedral_deg"]);
    if (json.contains("drawn_out"))
        print_plain("  the profile is drawn out to {:.6g} {} along y\n", json["drawn_out"], unit);
    for (const Json& region : json["regions"]) {
        const double volume = region["volume"], exact = region["volume_by_surfaces"];
        if (region["tetrahedra"] == 0)
            print_plain(
                "  region    {:<12} none: {:.3g} {}^3 between the saved surfaces are too little to mesh\n",
                region["name"], exact, unit);
        else
            print_plain(
                "  region    {:<12} {:>9} tetrahedra, {:.6g} {}^3 ({:+.2f} % of the saved surfaces')\n",
                region["name"], region["tetrahedra"], volume, unit,
                100.0 * (volume - exact) / std::max(std::abs(exact), 1e-300));
    }
    constexpr double kEnough = 5.0;  // degrees between faces
    if (quality["min_dihedral_deg"] < kEnough)
        print_plain(
            "  note: angles below 5 degrees are left, where fronts meet at small angles: another --size may avoid them\n");
    for (const Json& boundary : json["boundaries"])
        print_plain("  boundary  {:<12} {:>9} triangles, {:.6g} {}^2\n", boundary["name"],
                    boundary["triangles"], boundary["area"], unit);
}

Json plane_json(const PlaneMesh& plane) {
    Json json;
    json["vertices"] = plane.vertices.size();
    json["triangles"] = plane.triangles.size();
    std::vector<double> area(plane.regions.size()), length(plane.boundaries.size());
    const auto& p = plane.vertices;
    for (std::size_t t = 0; t < plane.triangles.size(); ++t) {
        const auto [a, b, c] = plane.triangles[t];
        area[static_cast<std::size_t>(plane.region[t])] += 0.5 * (p[b] - p[a]).cross(p[c] - p[a]).z();
    }
    for (std::size_t e = 0; e < plane.edges.size(); ++e)
        length[static_cast<std::size_t>(plane.boundary[e])] +=
            (p[plane.edges[e][1]] - p[plane.edges[e][0]]).norm();
    for (const char* list : {"regions", "boundaries"}) json[list] = Json::array();
    for (std::size_t r = 0; r < area.size(); ++r)
        json["regions"].push_back({{"name", plane.regions[r]}, {"area", area[r]}});
    for (std::size_t b = 0; b < length.size(); ++b)
        json["boundaries"].push_back({{"name", plane.boundaries[b]}, {"length", length[b]}});
    return json;
}

void print_plane(const Json& json, const std::string& unit) {
    print_plain("{} triangles, {} vertices\n", json["triangles"], json["vertices"]);
    for (const Json& region : json["regions"])
        print_plain("  region    {:<12} {:.6g} {}^2\n", region["name"], region["area"], unit);
    for (const Json& boundary : json["boundaries"])
        print_plain("  boundary  {:<12} {:.6g} {}\n", boundary["name"], boundary["length"], unit);
}

Json export_tetrahedra(const ExportArguments& arguments, const Result& result) {
    const double spacing = load_frame(fs::path(arguments.input) / "recipe.toml").domain.grid_spacing;
    if (arguments.triangles && !is_profile(result, spacing))
        throw RecipeError(
            "--triangles: this wafer is {:.4g} wide along y: only a profile, of a recipe with one extent, is a plane",
            bounding_box(result.surface).size().y());
    const double start = now();
    ProgressBar progress("tetrahedra", 1.0, "", arguments.json != "-");
    DeviceOptions options = arguments.options;
    options.progress = [&](double done) { progress.update(done); };
    const Device device = about(arguments.input, [&] { return make_device(result, spacing, options); });
    const double made = now();
    Json json;
    if (arguments.triangles) {
        const PlaneMesh plane = plane_of(device.mesh);
        surface::write_plane(arguments.output, plane, result.metadata);
        json = plane_json(plane);
    } else {
        surface::write_tets(arguments.output, device.mesh, result.metadata);
        json = quality_json(device);
    }
    json["seconds"] = {{"mesh", made - start}, {"total", now() - start}};
    return json;
}

Json export_blocks(const ExportArguments& arguments, const Result& result) {
    std::vector<std::pair<std::string, const TriangleMesh*>> blocks{{"surface", &result.surface}};
    for (std::size_t k = 0; k < result.interfaces.size(); ++k)
        blocks.emplace_back(fmt::format("interface_{}", k), &result.interfaces[k]);
    surface::write_vtm(arguments.output, blocks, result.metadata);
    Json json;
    json["blocks"] = Json::array();
    for (const auto& [name, mesh] : blocks) {
        json["blocks"].push_back(mesh_sizes(*mesh));
        json["blocks"].back()["name"] = name;
    }
    return json;
}

Json export_profile(const ExportArguments& arguments, const Result& result) {
    const surface::Plane plane = surface::parse_plane(arguments.cut);
    const std::vector<surface::Polyline> lines = surface::cut_by_plane(result.surface, plane);
    surface::write_whole_file(arguments.output, surface::profile_csv(lines, plane));
    return {{"cut", arguments.cut}, {"polylines", lines.size()}};
}

// Revolves the profiles of a round wafer, unless the output is a profile or --around is 0.
void make_round(const ExportArguments& arguments, Kind kind, Result& result) {
    const fs::path recipe = fs::path(arguments.input) / "recipe.toml";
    if (!fs::exists(recipe) || !is_axial(load_frame(recipe).domain)) return;
    if (kind == Kind::profile && surface::parse_plane(arguments.cut).normal.y() == 0.0)
        throw RecipeError("--cut {}: a round wafer has one profile, in r and z: use --cut y=0",
                          arguments.cut);
    if (kind == Kind::tetrahedra && !arguments.triangles)
        throw RecipeError(
            "-o {}: tetrahedra of round wafers are not made: use --triangles for its profile in r and z, or name a "
            ".stl, .obj, .ply, .vtp or .vtm for the surface all around",
            arguments.output);
    if ((kind != Kind::surface && kind != Kind::blocks) || arguments.around == 0) return;
    result.surface = revolved(result.surface, arguments.around);
    for (TriangleMesh& mesh : result.interfaces) mesh = revolved(mesh, arguments.around);
    std::erase_if(result.metadata.texts, [](const auto& text) { return text.first == "symmetry"; });
}

void run(const ExportArguments& arguments) {
    const Kind kind = kind_of(arguments);
    check_outputs(arguments, kind);
    Result result = read_input(arguments);
    make_round(arguments, kind, result);
    const std::string length = metadata_text(result.metadata, "length_unit", "");
    const double time = metadata_number(result.metadata, "time").value_or(0.0);
    Json json;
    if (kind == Kind::tetrahedra) {
        json = export_tetrahedra(arguments, result);
    } else if (kind == Kind::blocks) {
        json = export_blocks(arguments, result);
    } else if (kind == Kind::profile) {
        json = export_profile(arguments, result);
    } else {
        surface::write_mesh(arguments.output, result.surface, result.metadata);
        json = mesh_sizes(result.surface);
        json["dropped_attributes"] = surface::unwritable(arguments.output, result.surface);
    }
    json["file"] = arguments.output;
    json["source"] = result.source.string();
    json["time"] = time;
    json["length_unit"] = length;
    if (!arguments.json.empty()) write_json(arguments.json, json);
    if (arguments.json == "-") return;
    print_plain("{}: {} at time {:.6g} {}\n", arguments.output, result.source.filename().string(), time,
                metadata_text(result.metadata, "time_unit", ""));
    if (kind == Kind::tetrahedra && arguments.triangles)
        print_plane(json, length);
    else if (kind == Kind::tetrahedra)
        print_device(json, length);
    else if (kind == Kind::profile)
        print_plain("  the cut {}: {} lines\n", arguments.cut, json["polylines"]);
    else
        print_plain("  {}\n",
                    kind == Kind::blocks
                        ? fmt::format("{} blocks: the surface and the interfaces", json["blocks"].size())
                        : fmt::format("{} vertices, {} triangles", json["vertices"], json["triangles"]));
}

}  // namespace

void add_export_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "export", "Write a result for other programs: tetrahedra of all materials, or surfaces");
    auto arguments = std::make_shared<ExportArguments>();
    add_option(command, "input", arguments->input, "DIR", "Folder that `run` wrote", {.required = true});
    add_option(
        command, "-o,--output", arguments->output, "FILE",
        "File to write: tetrahedra as .vtu (VTK) or .msh (Gmsh 2.2), the wafer's surface as .stl, .obj, "
        ".ply or .vtp, surface and interfaces as .vtm, or the profile in the plane --cut as .csv",
        {.required = true});
    add_choice_options(command, arguments->choice);
    add_option(command, "--cut", arguments->cut, "AXIS=VALUE",
               "For a .csv: plane of the profile (default: y=0)");
    add_option(
        command, "--size", arguments->options.size, "L",
        "Longest edge of tetrahedra at the surface and interfaces, in the recipe's length unit (default: 2 "
        "grid spacings, or more to keep to --most); edges are shorter at curved parts and thin films, and "
        "longer far away");
    add_option(
        command, "--most", arguments->options.most, "N",
        "Without --size: edges become longer, and curves coarser, until there are about N tetrahedra at most");
    add_option(
        command, "--bottom", arguments->options.bottom, "Z",
        "Height of the substrate's underside (default: a quarter of the larger extent below all else)");
    command.add_flag("--gas", arguments->options.gas,
                     "Mesh the gas above and in voids, too, as a region `gas`");
    command.add_flag(
        "--triangles", arguments->triangles,
        "For a profile, a wafer of one extent: triangles of all materials in x and z instead of tetrahedra");
    add_option(
        command, "--around", arguments->around, "N",
        "For a round wafer: number of sides of the body of revolution that is written; 0: the profile, one "
        "cell wide (default: 64)")
        .check(CLI::IsMember({0}) | CLI::Range(3, 4096));
    add_option(
        command, "--json", arguments->json, "FILE",
        "Write sizes, regions with volumes, boundaries and quality here; - for standard output, and then "
        "nothing else there");
    command.callback([arguments] { run(*arguments); });
}

}  // namespace sidewall::app
