#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "app/commands/cli_options.hpp"
#include "app/commands/flux_io.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/processes.hpp"
#include "app/common/text.hpp"
#include "app/common/timing.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "surface/files/file.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/repair.hpp"

namespace sidewall::app {
namespace {

using flux::Boundary;

// Materials of a mesh: the distinct ids, ascending, and each triangle's index among them.
struct FluxMaterials {
    std::vector<std::int32_t> ids, of_triangle;
};

struct FluxArguments {
    std::string mesh, output, json, boundary, seed = "1";
    std::optional<std::string> method;  // not given: auto, which then does not print its choice
    std::optional<double> rays, relative_error, mean_free_path;
    std::string sticking = "1";  // one probability, or ID=s,ID=s
    double exponent = 1.0;       // of the source
};

constexpr double kDefaultRays = 1e6;
constexpr double kMostRays = 1e10;  // limit with --relative-error and without --rays

constexpr std::pair<const char*, Boundary> kBoundaries[] = {
    {"reflective", Boundary::reflective}, {"periodic", Boundary::periodic}, {"open", Boundary::open}};

std::array<Boundary, 2> parse_boundary(const std::string& text) {
    const auto words = split(text, ',');
    std::array<Boundary, 2> boundary{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::string& word = words.size() == 2 ? words[axis] : text;
        const auto found =
            std::ranges::find(kBoundaries, word, [](const auto& b) { return std::string(b.first); });
        if (found == std::end(kBoundaries))
            throw RecipeError(
                "--boundary {}: must be reflective, periodic or open, for both axes or as X,Y for each",
                text);
        boundary[axis] = found->second;
    }
    return boundary;
}

const char* name_of(Boundary boundary) {
    return std::ranges::find(kBoundaries, boundary, &std::pair<const char*, Boundary>::second)->first;
}

template <typename Number>
Number parse_number(const std::string& text, const std::string& where) {
    Number value{};
    if (!surface::read_number(text, value)) throw RecipeError("{}: \"{}\" is not a number", where, text);
    return value;
}

double parse_probability(const std::string& text, const std::string& where) {
    const double value = parse_number<double>(text, where);
    if (!(value >= 0.0 && value <= 1.0)) throw RecipeError("{}: must be in [0, 1]", where);
    return value;
}

// Parses one sticking probability for all, or ID=s,ID=s; returns one for each of \p ids in their order.
std::vector<double> parse_sticking(const std::string& text, const std::vector<std::int32_t>& ids,
                                   const std::string& path) {
    if (text.find('=') == std::string::npos) return {parse_probability(text, "--sticking " + text)};
    std::vector<double> sticking(ids.size(), -1.0);
    for (const std::string& part : split(text, ',')) {
        const std::string where = "--sticking " + part;
        const auto equals = part.find('=');
        if (equals == std::string::npos)
            throw RecipeError(where + ": write ID=s, as in --sticking 0=0.1,1=0.5");
        const auto id = parse_number<std::int32_t>(part.substr(0, equals), where);
        const double value = parse_probability(part.substr(equals + 1), where);
        const auto found = std::lower_bound(ids.begin(), ids.end(), id);
        if (found == ids.end() || *found != id)
            throw RecipeError("{}: {} has no material {}; it has {}", where, path, id, fmt::join(ids, ", "));
        double& slot = sticking[static_cast<std::size_t>(found - ids.begin())];
        if (slot >= 0.0) throw RecipeError("{}: material {} is given twice", where, id);
        slot = value;
    }
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (sticking[i] < 0.0)
            throw RecipeError("--sticking {}: material {} of {} is missing", text, ids[i], path);
    return sticking;
}

// Reads the triangle attribute `material`. Without it there is one material, of id 0; of_triangle is empty.
FluxMaterials flux_materials(const TriangleMesh& mesh, const std::string& path) {
    const Attribute* attribute = mesh.triangle_attribute("material");
    if (!attribute) return {{0}, {}};
    if (attribute->components != 1 || attribute->values.size() != mesh.triangles.size())
        throw FileError("{}: attribute material must be one integer a triangle", path);
    FluxMaterials materials;
    for (std::size_t t = 0; t < attribute->values.size(); ++t) {
        const double value = attribute->values[t];
        if (!(std::abs(value) <= 2147483647.0) || value != std::floor(value))
            throw FileError("{}: triangle {} has material {}: must be an integer", path, t, value);
        materials.of_triangle.push_back(static_cast<std::int32_t>(value));
    }
    materials.ids = materials.of_triangle;
    std::sort(materials.ids.begin(), materials.ids.end());
    materials.ids.erase(std::unique(materials.ids.begin(), materials.ids.end()), materials.ids.end());
    for (std::int32_t& id : materials.of_triangle)
        id = static_cast<std::int32_t>(std::lower_bound(materials.ids.begin(), materials.ids.end(), id) -
                                       materials.ids.begin());
    return materials;
}

flux::Species species_of(const FluxArguments& arguments, const TriangleMesh& mesh,
                         const std::vector<std::int32_t>& ids) {
    flux::Species species{"flux", arguments.exponent,
                          parse_sticking(arguments.sticking, ids, arguments.mesh)};
    if (!arguments.mean_free_path) return species;
    // Diffusion over n mean free paths takes about n^2 collisions.
    constexpr double kLeast = 1e-3;  // least mean free path over the diagonal of the bounding box
    const double least = kLeast * bounding_box(mesh).size().norm();
    if (!(*arguments.mean_free_path >= least))
        throw RecipeError(
            "--mean-free-path {:g}: particles would collide too often to be followed: give a length of "
            "{:.3g} or more, a thousandth of the surface's size",
            *arguments.mean_free_path, least);
    species.mean_free_path = *arguments.mean_free_path;
    return species;
}

TriangleMesh read_repaired(const std::string& path, surface::MeshMetadata& metadata) {
    TriangleMesh mesh = surface::read_mesh(path, &metadata);
    if (is_round_profile(metadata))
        throw RecipeError(
            "{}: this is the profile of a round wafer, not a surface: `sidewall export DIR -o MESH.stl` "
            "makes its surface all around",
            path);
    flux::require_traceable(mesh);
    const std::string words = surface::repair_summary(surface::repair(mesh));
    if (!words.empty()) print_warning(fmt::format("sidewall flux: {}: {}", path, words));
    return mesh;
}

flux::LateralBox find_box(const TriangleMesh& mesh, const FluxArguments& arguments) {
    if (!arguments.boundary.empty()) return flux::lateral_box(mesh, parse_boundary(arguments.boundary));
    try {
        return flux::lateral_box(mesh, {Boundary::reflective, Boundary::reflective});
    } catch (const GeometryError& reason) {
        const auto box = flux::lateral_box(mesh, {Boundary::open, Boundary::open});
        print_warning(fmt::format(
            "sidewall flux: {}: the sides are taken as open, particles leave there and none come in: {}",
            arguments.mesh, reason.what()));
        return box;
    }
}

std::uint64_t parse_rays(const FluxArguments& arguments) {
    const double rays = arguments.rays.value_or(arguments.relative_error ? kMostRays : kDefaultRays);
    if (!(rays >= 1.0 && rays <= 1e12) || rays != std::floor(rays))
        throw RecipeError("--rays {}: must be a whole number from 1 to 1e12", rays);
    return static_cast<std::uint64_t>(rays);
}

void check_arguments(const FluxArguments& arguments) {
    const auto extension = fs::path(arguments.output).extension();
    if (!arguments.output.empty() && extension != ".vtp" && extension != ".csv")
        throw RecipeError("-o {}: must end in .vtp or .csv", arguments.output);
    for (const std::string& path : {arguments.output, arguments.json})
        if (path != "-" && fs::is_directory(path)) throw IoError("{}: is a folder; name a file", path);
    if (!arguments.output.empty() && arguments.output == arguments.json)
        throw RecipeError("--json {}: is the output file, too; name another", arguments.json);
    if (!arguments.boundary.empty()) parse_boundary(arguments.boundary);
    if (arguments.relative_error && !(*arguments.relative_error > 0.0))
        throw RecipeError("--relative-error {:g}: must be above 0, such as 0.01", *arguments.relative_error);
    if (arguments.mean_free_path && arguments.method == "radiosity")
        throw RecipeError(
            "--mean-free-path {:g}: radiosity knows no collisions in the gas: use --method monte-carlo",
            *arguments.mean_free_path);
    parse_rays(arguments);
    parse_number<std::uint64_t>(arguments.seed, "--seed");
}

// The part of the summary that both methods share.
Json summarise(const FluxArguments& arguments, const TriangleMesh& mesh, const flux::LateralBox& box,
               const flux::TallyFlux& result) {
    double area = 0.0, weighted = 0.0, low = kInfinity, high = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double a = triangle_area(mesh, t);
        if (!(a > 0.0)) continue;
        area += a;
        weighted += a * result.triangle.flux[t];
        low = std::min(low, result.triangle.flux[t]);
        high = std::max(high, result.triangle.flux[t]);
    }
    Json json;
    json["mesh"] = arguments.mesh;
    json["vertices"] = mesh.vertices.size();
    json["triangles"] = mesh.triangles.size();
    json["boundary"] = {name_of(box.boundary[0]), name_of(box.boundary[1])};
    json["source_exponent"] = arguments.exponent;
    json["sticking"] = arguments.sticking;
    if (arguments.mean_free_path) json["mean_free_path"] = *arguments.mean_free_path;
    json["seed"] = parse_number<std::uint64_t>(arguments.seed, "--seed");
    json["threads"] = thread_count();
    json["flux"] = {{"mean", weighted / area}, {"min", low}, {"max", high}};
    return json;
}

void print_choice(const flux::MethodChoice& choice) {
    print_warning(
        !choice.why_not.empty() ? fmt::format("sidewall flux: monte-carlo is taken: {}", choice.why_not)
        : choice.viewed
            ? "sidewall flux: radiosity is taken: what a profile sees of itself is found without rays"
            : fmt::format(
                  "sidewall flux: {} is taken: to a relative error of {:.2g} monte-carlo costs about {:.2g} and "
                  "radiosity {:.2g} million segments{}",
                  choice.radiosity ? "radiosity" : "monte-carlo", choice.target,
                  choice.monte_carlo_cost * 1e-6, choice.radiosity_cost * 1e-6,
                  choice.spent > 0.0 ? fmt::format(", of which {:.2g} are spent", choice.spent * 1e-6) : ""));
}

void run_flux(const FluxArguments& arguments) {
    check_arguments(arguments);
    surface::MeshMetadata metadata;
    const TriangleMesh mesh = read_repaired(arguments.mesh, metadata);
    const FluxMaterials materials = flux_materials(mesh, arguments.mesh);
    const flux::Species species = species_of(arguments, mesh, materials.ids);
    const flux::LateralBox box = find_box(mesh, arguments);
    const flux::Wedges wedges = flux::make_wedges(mesh, materials.of_triangle);
    const double start = now();
    const surface::RayScene scene(mesh);
    const double bvh = now() - start;

    std::optional<ProgressBar> bar(std::in_place, "flux", 100.0, "%");
    const std::string method = arguments.method.value_or("auto");
    bool choosing = method == "auto";  // while auto still compares methods, no progress is shown
    const flux::SingleFlux asked{mesh,
                                 materials.of_triangle,
                                 box,
                                 wedges,
                                 scene,
                                 species,
                                 {.rays = parse_rays(arguments),
                                  .relative_error = arguments.relative_error,
                                  .seed = parse_number<std::uint64_t>(arguments.seed, "--seed"),
                                  .progress =
                                      [&](double fraction) {
                                          if (!choosing) bar->update(100.0 * fraction);
                                      },
                                  .stop = interrupted},
                                 arguments.rays.has_value()};
    install_interrupt_handler();  // before this line Ctrl-C ends the program at once
    const flux::FoundFlux found = flux::find_flux(method, asked, [&](const flux::MethodChoice& choice) {
        choosing = false;
        if (arguments.method) print_choice(choice);
    });
    bar.reset();
    if (flux::leaks_too_much(found.leaked, found.emitted))
        throw NumericsError(
            "{}: {} of {} particles went through the surface: it has holes, overlaps, pieces turned "
            "inside out that are hidden from above or, with periodic sides, opposite ends that do "
            "not match",
            arguments.mesh, found.leaked, found.emitted);
    if (found.leaked > 0)
        print_warning(fmt::format("sidewall flux: {} of {} particles went through the surface", found.leaked,
                                  found.emitted));
    if (!arguments.output.empty()) write_flux(arguments.output, mesh, metadata, found);
    Json json = summarise(arguments, mesh, box, found);
    json.merge_patch(found_json(found));
    json["seconds"]["bvh"] = bvh;
    if (!arguments.json.empty()) write_json(arguments.json, json);
    if (arguments.json != "-") print_flux_summary(json);
    const double error = json["relative_error"].get<double>();
    if (arguments.relative_error && !(error <= *arguments.relative_error))
        throw NumericsError(
            "{}: relative error {:.3g} after {} rays, above the {:.3g} asked for{}: {} or ask for less",
            arguments.mesh, error, found.emitted, *arguments.relative_error,
            arguments.output.empty() && arguments.json.empty() ? "" : " (what they gave is written)",
            json.value("discretisation_error", 0.0) > flux::kDiscretisationShare * *arguments.relative_error
                ? fmt::format("{:.3g} of it are the linear elements, so give a finer mesh",
                              json["discretisation_error"])
                : "allow more rays with --rays");
}

}  // namespace

void add_flux_command(CLI::App& program) {
    const auto arguments = std::make_shared<FluxArguments>();
    CLI::App& command = *program.add_subcommand(
        "flux", "Particle flux on a surface, by Monte Carlo ray tracing or radiosity");
    add_option(command, "mesh", arguments->mesh, "MESH",
               "The surface: .vtp, .ply, .stl or .obj, normals out of the material, z up",
               {.required = true});
    add_option(command, "-o,--output", arguments->output, "FILE",
               "Write flux, flux_error and area: .vtp or .csv");
    add_option(
        command, "--method", arguments->method, "{auto,monte-carlo,radiosity}",
        "monte-carlo follows particles from the source; radiosity traces rays between points of the "
        "surface and solves for their balance, which reaches deep places at low sticking in a fraction "
        "of the time; auto takes the one that costs less (default auto)",
        {.one_of = {"auto", "monte-carlo", "radiosity"}});
    add_option(
        command, "--rays", arguments->rays, "N",
        fmt::format("Source rays, rounded up to a multiple of 32 (default {:.0e}), or for radiosity rays "
                    "between points of the surface (default 64 per unknown); with --relative-error the "
                    "most rays, default {:.0e}",
                    kDefaultRays, kMostRays));
    add_option(command, "--relative-error", arguments->relative_error, "E",
               "Trace until sum(area * standard error) / sum(area * flux) over vertices is at most this");
    add_option(command, "--source-exponent", arguments->exponent, "n",
               "n of the source's cos^n: 1 thermal, hundreds a beam (default 1)");
    add_option(command, "--sticking", arguments->sticking, "s",
               "Sticking probability, or one for each id in the triangles' attribute material: ID=s,ID=s "
               "(default 1)");
    add_option(
        command, "--mean-free-path", arguments->mean_free_path, "L",
        "Mean free path between isotropic collisions in the gas, in the surface's unit; for monte-carlo (default: no "
        "collisions)");
    add_option(
        command, "--boundary", arguments->boundary, "{reflective,periodic,open}",
        "Sides of the domain; X,Y: those across x and across y (default reflective if the surface ends on "
        "a rectangle, else open). No particle comes in through open sides: the source is the surface's "
        "bounding rectangle");
    add_option(command, "--seed", arguments->seed, "k", "Seed of the random numbers (default 1)");
    add_option(command, "--json", arguments->json, "FILE",
               "Write a summary as JSON; - for standard output, and then nothing else there");
    command.callback([arguments] { about(arguments->mesh, [&] { run_flux(*arguments); }); });
}

}  // namespace sidewall::app
