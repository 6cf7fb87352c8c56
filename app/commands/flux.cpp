#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "app/commands/about.hpp"
#include "app/commands/commands.hpp"
#include "app/commands/flux_results.hpp"
#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/progress.hpp"
#include "app/common/text.hpp"
#include "app/common/threads.hpp"
#include "app/common/timing.hpp"
#include "flux/leaks.hpp"
#include "flux/mend.hpp"
#include "flux/radiosity.hpp"
#include "flux/tracer.hpp"
#include "surface/error.hpp"
#include "surface/mesh_io.hpp"

namespace sidewall::app {
namespace {

using flux::Boundary;

struct FluxArguments {
    std::string mesh, output, json, boundary, sticking = "1", seed = "1", method = "monte-carlo";
    std::optional<double> rays, relative_error;
    double source_exponent = 1.0;
};

constexpr double kDefaultRays = 1e6;
constexpr double kMostRays = 1e10;  // that --relative-error spends unless --rays says otherwise

template <typename Number>
Number parse_number(const std::string& text, const std::string& where) {
    Number value{};
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc{} || end != text.data() + text.size())
        throw RecipeError(fmt::format("{}: \"{}\" is not a number", where, text));
    return value;
}

double parse_probability(const std::string& text, const std::string& where) {
    const double value = parse_number<double>(text, where);
    if (!(value >= 0.0 && value <= 1.0)) throw RecipeError(fmt::format("{}: must be in [0, 1]", where));
    return value;
}

std::array<Boundary, 2> parse_boundary(const std::string& text) {
    const auto words = split(text, ',');
    std::array<Boundary, 2> boundary{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::string& word = words.size() == 2 ? words[axis] : text;
        if (word == "reflective")
            boundary[axis] = Boundary::reflective;
        else if (word == "periodic")
            boundary[axis] = Boundary::periodic;
        else if (word == "open")
            boundary[axis] = Boundary::open;
        else
            throw RecipeError(fmt::format(
                "--boundary {}: must be reflective, periodic or open, for both axes or as X,Y for each",
                text));
    }
    return boundary;
}

const char* name_of(Boundary boundary) {
    return boundary == Boundary::open ? "open" : boundary == Boundary::periodic ? "periodic" : "reflective";
}

// The distinct material ids, ascending, and each triangle's place among them: ids need not be small.
struct Materials {
    std::vector<std::int32_t> ids, of_triangle;
};

Materials read_materials(const TriangleMesh& mesh, const std::string& path) {
    const Attribute* attribute = mesh.triangle_attribute("material");
    if (!attribute) return {{0}, {}};
    if (attribute->components != 1 || attribute->values.size() != mesh.triangles.size())
        throw FileError(fmt::format("{}: attribute material must be one integer a triangle", path));
    Materials materials;
    for (std::size_t t = 0; t < attribute->values.size(); ++t) {
        const double value = attribute->values[t];
        if (!(std::abs(value) <= 2147483647.0) || value != std::floor(value))
            throw FileError(
                fmt::format("{}: triangle {} has material {}: must be an integer", path, t, value));
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

// One sticking probability, or one for each of the ids in their order.
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
            throw RecipeError(
                fmt::format("{}: {} has no material {}; it has {}", where, path, id, fmt::join(ids, ", ")));
        double& slot = sticking[static_cast<std::size_t>(found - ids.begin())];
        if (slot >= 0.0) throw RecipeError(fmt::format("{}: material {} is given twice", where, id));
        slot = value;
    }
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (sticking[i] < 0.0)
            throw RecipeError(fmt::format("--sticking {}: material {} of {} is missing", text, ids[i], path));
    return sticking;
}

TriangleMesh read_mended(const std::string& path) {
    TriangleMesh mesh = surface::read_mesh(path);
    const flux::Mending mending = flux::mend(mesh);
    if (mending.unused > 0)
        fmt::print(stderr, "sidewall flux: {}: {} vertices that no triangle uses were dropped\n", path,
                   mending.unused);
    if (mending.repeated > 0)
        fmt::print(stderr, "sidewall flux: {}: {} triangles that are listed again were dropped\n", path,
                   mending.repeated);
    if (mending.welded > 0)
        fmt::print(stderr,
                   "sidewall flux: {}: {} vertices of the same position as another were merged with it\n",
                   path, mending.welded);
    if (mending.turned == mesh.triangles.size())
        fmt::print(stderr,
                   "sidewall flux: {}: the surface was inside out: all {} triangles were turned over\n", path,
                   mending.turned);
    else if (mending.turned > 0)
        fmt::print(
            stderr,
            "sidewall flux: {}: {} of {} triangles were turned over, so that all agree and show the source "
            "their front\n",
            path, mending.turned, mesh.triangles.size());
    return mesh;
}

flux::LateralBox find_box(const TriangleMesh& mesh, const FluxArguments& arguments) {
    if (!arguments.boundary.empty()) return flux::lateral_box(mesh, parse_boundary(arguments.boundary));
    try {
        return flux::lateral_box(mesh, {Boundary::reflective, Boundary::reflective});
    } catch (const GeometryError& reason) {
        const auto box = flux::lateral_box(mesh, {Boundary::open, Boundary::open});
        fmt::print(
            stderr,
            "sidewall flux: {}: the sides are taken as open, particles leave there and none come in: {}\n",
            arguments.mesh, reason.what());
        return box;
    }
}

std::uint64_t parse_rays(const FluxArguments& arguments) {
    const double rays = arguments.rays.value_or(arguments.relative_error ? kMostRays : kDefaultRays);
    if (!(rays >= 1.0 && rays <= 1e12) || rays != std::floor(rays))
        throw RecipeError(fmt::format("--rays {}: must be a whole number from 1 to 1e12", rays));
    return static_cast<std::uint64_t>(rays);
}

void check_arguments(const FluxArguments& arguments) {
    const auto extension = std::filesystem::path(arguments.output).extension();
    if (!arguments.output.empty() && extension != ".vtp" && extension != ".csv")
        throw RecipeError(fmt::format("-o {}: must end in .vtp or .csv", arguments.output));
    for (const std::string& path : {arguments.output, arguments.json})
        if (path != "-" && std::filesystem::is_directory(path))
            throw IoError(fmt::format("{}: is a folder; name a file", path));
    if (!arguments.output.empty() && arguments.output == arguments.json)
        throw RecipeError(fmt::format("--json {}: is the output file, too; name another", arguments.json));
    if (!arguments.boundary.empty()) parse_boundary(arguments.boundary);
    parse_rays(arguments);
    parse_number<std::uint64_t>(arguments.seed, "--seed");
}

// What both methods have in common.
Json summarise(const FluxArguments& arguments, const TriangleMesh& mesh, const flux::LateralBox& box,
               const flux::TallyFlux& result) {
    double area = 0.0, weighted = 0.0, low = std::numeric_limits<double>::infinity(), high = 0.0;
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
    json["source_exponent"] = arguments.source_exponent;
    json["sticking"] = arguments.sticking;
    json["seed"] = parse_number<std::uint64_t>(arguments.seed, "--seed");
    json["threads"] = thread_count();
    json["flux"] = {{"mean", weighted / area}, {"min", low}, {"max", high}};
    return json;
}

// A surface, ready for either method, and what to do on it.
struct Task {
    const FluxArguments& arguments;
    const TriangleMesh& mesh;
    const Materials& materials;
    const flux::LateralBox& box;
    const flux::Wedges& wedges;
    const surface::RayScene& scene;
    flux::Species species;
    flux::TraceOptions options;
};

struct Outcome {
    flux::TallyFlux flux;
    Json json;
    std::uint64_t leaked = 0, emitted = 0;
};

Outcome trace(const Task& t) {
    const auto target = t.arguments.relative_error;
    const flux::FluxResult result = target ? flux::trace_flux_to(*target, t.mesh, t.scene, t.box, t.species,
                                                                 t.materials.of_triangle, t.wedges, t.options)
                                           : flux::trace_flux(t.mesh, t.scene, t.box, t.species,
                                                              t.materials.of_triangle, t.wedges, t.options);
    return {result, traced_json(result), result.leaked, result.emitted};
}

Outcome solve(const Task& t) {
    const std::vector<double> sticking =
        flux::sticking_by_wedge(t.wedges, t.materials.of_triangle, t.species);
    flux::Exchange exchange(t.mesh, t.scene, t.box, t.wedges, {t.species.source_exponent},
                            {.seed = t.options.seed, .progress = t.options.progress, .stop = t.options.stop});
    const flux::DiffuseSpecies species{
        .name = "flux", .source_exponent = t.species.source_exponent, .sticking = sticking};
    constexpr std::uint64_t kRaysOfUnknown = 64;  // unless told
    const std::uint64_t rays = t.arguments.rays || t.arguments.relative_error
                                   ? t.options.rays
                                   : std::min(kRaysOfUnknown * t.wedges.count(), exchange.rays_left());
    flux::RadiosityFlux result;
    if (t.arguments.relative_error) {
        result = std::move(flux::solve_fluxes_to(*t.arguments.relative_error, exchange, {&species, 1}, rays,
                                                 {.stop = t.options.stop})
                               .front());
    } else {
        exchange.gather(rays);
        result = flux::solve_flux(exchange, species, {.stop = t.options.stop});
    }
    return {result, solved_json(exchange, result), exchange.leaked(), exchange.rays()};
}

// The method asked for, or the faster one, and why.
bool takes_radiosity(const Task& t, Json& json) {
    if (t.arguments.method != "auto") return t.arguments.method == "radiosity";
    flux::TraceOptions options = t.options;
    if (!t.arguments.rays) options.rays = static_cast<std::uint64_t>(kDefaultRays);
    const flux::MethodChoice choice =
        flux::choose_method(t.arguments.relative_error.value_or(0.0), t.mesh, t.scene, t.box, t.species,
                            t.materials.of_triangle, t.wedges, options);
    json["auto"] = {{"relative_error", choice.target},
                    {"monte_carlo_cost", choice.monte_carlo_cost},
                    {"radiosity_cost", choice.radiosity_cost}};
    fmt::print(stderr,
               "sidewall flux: {} is taken: to a relative error of {:.2g} monte-carlo costs about {:.2g} and "
               "radiosity {:.2g} million segments\n",
               choice.radiosity ? "radiosity" : "monte-carlo", choice.target, choice.monte_carlo_cost * 1e-6,
               choice.radiosity_cost * 1e-6);
    return choice.radiosity;
}

void run_flux(const FluxArguments& arguments) {
    check_arguments(arguments);
    const TriangleMesh mesh = read_mended(arguments.mesh);
    const Materials materials = read_materials(mesh, arguments.mesh);
    const flux::Species species{"flux", arguments.source_exponent,
                                parse_sticking(arguments.sticking, materials.ids, arguments.mesh)};
    const flux::LateralBox box = find_box(mesh, arguments);
    const flux::Wedges wedges = flux::make_wedges(mesh, materials.of_triangle);
    const double start = now();
    const surface::RayScene scene(mesh);
    const double bvh = now() - start;

    std::optional<ProgressBar> bar(std::in_place, "flux", 100.0, "%");
    const Task task{arguments,
                    mesh,
                    materials,
                    box,
                    wedges,
                    scene,
                    species,
                    {.rays = parse_rays(arguments),
                     .seed = parse_number<std::uint64_t>(arguments.seed, "--seed"),
                     .progress = [&](double fraction) { bar->update(100.0 * fraction); },
                     .stop = interrupted}};
    install_interrupt_handler();  // until here Ctrl-C ends the program at once
    Json why;
    const bool radiosity = takes_radiosity(task, why);
    const Outcome outcome = radiosity ? solve(task) : trace(task);
    bar.reset();
    if (flux::leaks_too_much(outcome.leaked, outcome.emitted))
        throw NumericsError(fmt::format(
            "{}: {} of {} particles went through the surface: it has holes, overlaps, pieces turned "
            "inside out that are hidden from above or, with periodic sides, opposite ends that do "
            "not match",
            arguments.mesh, outcome.leaked, outcome.emitted));
    if (outcome.leaked > 0)
        fmt::print(stderr, "sidewall flux: {} of {} particles went through the surface\n", outcome.leaked,
                   outcome.emitted);
    if (!arguments.output.empty()) write_flux(arguments.output, mesh, outcome.flux);
    Json json = summarise(arguments, mesh, box, outcome.flux);
    json.merge_patch(outcome.json);
    if (!why.is_null()) json.merge_patch(why);
    json["seconds"]["bvh"] = bvh;
    if (!arguments.json.empty()) write_json(arguments.json, json);
    if (arguments.json != "-") print_summary(json);
    const double error = json["relative_error"].get<double>();
    if (arguments.relative_error && !(error <= *arguments.relative_error))
        throw NumericsError(fmt::format(
            "{}: relative error {:.3g} after {} rays, above the {:.3g} asked for{}: allow more rays with "
            "--rays or ask for less",
            arguments.mesh, error, outcome.emitted, *arguments.relative_error,
            arguments.output.empty() && arguments.json.empty() ? "" : " (what they gave is written)"));
}

}  // namespace

void add_flux_command(CLI::App& program) {
    const auto arguments = std::make_shared<FluxArguments>();
    CLI::App& command =
        add_command(program, "flux", "Particle flux on a surface, by Monte Carlo ray tracing or radiosity");
    add_option(command, "mesh", arguments->mesh, "MESH",
               "The surface: .vtp, .ply, .stl or .obj, normals out of the material, z up",
               {.required = true});
    add_option(command, "-o,--output", arguments->output, "FILE",
               "Write flux, flux_error and area: .vtp or .csv");
    add_option(
        command, "--method", arguments->method, "{auto,monte-carlo,radiosity}",
        "monte-carlo follows particles from the source; radiosity traces rays between points of the "
        "surface and solves for their balance, which reaches deep places at low sticking in a fraction "
        "of the time; auto takes the one that costs less (default monte-carlo)",
        {.one_of = {"auto", "monte-carlo", "radiosity"}});
    add_option(
        command, "--rays", arguments->rays, "N",
        fmt::format("Source rays, rounded up to a multiple of 32 (default {:.0e}), or of radiosity, rays "
                    "between points of the surface (default 64 an unknown); with --relative-error the "
                    "most to spend, default {:.0e}",
                    kDefaultRays, kMostRays));
    add_option(command, "--relative-error", arguments->relative_error, "E",
               "Trace until sum(area * standard error) / sum(area * flux) over vertices is at most this");
    add_option(command, "--source-exponent", arguments->source_exponent, "n",
               "n of the source's cos^n: 1 thermal, hundreds a beam (default 1)");
    add_option(command, "--sticking", arguments->sticking, "s",
               "Sticking probability, or one for each id of the per-triangle attribute material: "
               "ID=s,ID=s (default 1)");
    add_option(
        command, "--boundary", arguments->boundary, "{reflective,periodic,open}",
        "Sides of the domain; X,Y sets them apart (default reflective if the surface ends on a rectangle, "
        "else open). No particle comes in through open sides: the source is the surface's bounding "
        "rectangle");
    add_option(command, "--seed", arguments->seed, "k", "Of the random numbers (default 1)");
    add_option(command, "--json", arguments->json, "FILE", "Write a summary; - prints it, and nothing else");
    run_by(command, [arguments] { about(arguments->mesh, [&] { run_flux(*arguments); }); });
}

}  // namespace sidewall::app
