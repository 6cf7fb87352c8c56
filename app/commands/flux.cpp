#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "app/commands/about.hpp"
#include "app/commands/commands.hpp"
#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/progress.hpp"
#include "app/common/text.hpp"
#include "app/common/threads.hpp"
#include "app/common/timing.hpp"
#include "flux/leaks.hpp"
#include "flux/mend.hpp"
#include "flux/tracer.hpp"
#include "surface/error.hpp"
#include "surface/mesh_io.hpp"

namespace sidewall::app {
namespace {

using flux::Boundary;

struct FluxArguments {
    std::string mesh, output, json, boundary, sticking = "1", seed = "1";
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

std::string csv_text(const TriangleMesh& mesh, const flux::FluxResult& result) {
    std::string text = "triangle,x,y,z,area,flux,flux_error\n";
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 c = triangle_centroid(mesh, t);
        fmt::format_to(std::back_inserter(text), "{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", t, c.x(),
                       c.y(), c.z(), triangle_area(mesh, t), result.triangle.flux[t],
                       result.triangle.error[t]);
    }
    return text;
}

void set_attribute(std::vector<Attribute>& attributes, const std::string& name, std::vector<double> values) {
    std::erase_if(attributes, [&](const Attribute& a) { return a.name == name; });
    attributes.push_back({name, 1, Scalar::float64, std::move(values)});
}

void write_output(const std::string& path, TriangleMesh mesh, const flux::FluxResult& result) {
    if (std::filesystem::path(path).extension() == ".csv") return write_file(path, csv_text(mesh, result));
    std::vector<double> area(mesh.triangles.size());
    for (std::size_t t = 0; t < area.size(); ++t) area[t] = triangle_area(mesh, t);
    set_attribute(mesh.triangle_attributes, "flux", result.triangle.flux);
    set_attribute(mesh.triangle_attributes, "flux_error", result.triangle.error);
    set_attribute(mesh.triangle_attributes, "area", std::move(area));
    set_attribute(mesh.vertex_attributes, "flux", result.vertex.flux);
    set_attribute(mesh.vertex_attributes, "flux_error", result.vertex.error);
    surface::write_mesh(path, mesh);
}

Json summarise(const FluxArguments& arguments, const TriangleMesh& mesh, const flux::LateralBox& box,
               const flux::FluxResult& result, double bvh_seconds) {
    double area = 0.0, weighted = 0.0, low = std::numeric_limits<double>::infinity(), high = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double a = triangle_area(mesh, t);
        if (!(a > 0.0)) continue;
        area += a;
        weighted += a * result.triangle.flux[t];
        low = std::min(low, result.triangle.flux[t]);
        high = std::max(high, result.triangle.flux[t]);
    }
    const auto emitted = static_cast<double>(result.emitted);
    Json json;
    json["mesh"] = arguments.mesh;
    json["vertices"] = mesh.vertices.size();
    json["triangles"] = mesh.triangles.size();
    json["boundary"] = {name_of(box.boundary[0]), name_of(box.boundary[1])};
    json["source_exponent"] = arguments.source_exponent;
    json["sticking"] = arguments.sticking;
    json["seed"] = parse_number<std::uint64_t>(arguments.seed, "--seed");
    json["threads"] = thread_count();
    json["rays"] = result.emitted;
    json["segments"] = result.segments;
    json["seconds"] = {{"bvh", bvh_seconds}, {"trace", result.seconds}};
    json["rays_per_second"] = emitted / result.seconds;
    json["segments_per_second"] = static_cast<double>(result.segments) / result.seconds;
    json["arrivals"] = result.arrivals;
    json["absorbed"] = result.absorbed;
    json["escaped"] = result.escaped;
    json["escaped_fraction"] = static_cast<double>(result.escaped) / emitted;
    json["leaked"] = result.leaked;
    json["rescued"] = result.rescued;
    json["flux"] = {{"mean", weighted / area}, {"min", low}, {"max", high}};
    json["relative_error"] = result.relative_error;
    return json;
}

void print_summary(const Json& json) {
    fmt::print("{} triangles, {} rays, {} segments in {:.3g} s ({:.3g} rays/s)\n",
               json["triangles"].get<std::size_t>(), json["rays"].get<std::uint64_t>(),
               json["segments"].get<std::uint64_t>(), json["seconds"]["trace"].get<double>(),
               json["rays_per_second"].get<double>());
    fmt::print(
        "flux (1 on an open plane): mean {:.4g}, least {:.4g}, largest {:.4g} of a triangle; "
        "relative error of vertex flux {:.3g}\n",
        json["flux"]["mean"].get<double>(), json["flux"]["min"].get<double>(),
        json["flux"]["max"].get<double>(), json["relative_error"].get<double>());
    fmt::print("absorbed {}, escaped {}, leaked {}\n", json["absorbed"].get<std::uint64_t>(),
               json["escaped"].get<std::uint64_t>(), json["leaked"].get<std::uint64_t>());
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

    flux::TraceOptions options{.rays = parse_rays(arguments),
                               .seed = parse_number<std::uint64_t>(arguments.seed, "--seed")};
    std::optional<ProgressBar> bar(std::in_place, "flux", 100.0, "%");
    options.progress = [&](double fraction) { bar->update(100.0 * fraction); };
    options.stop = interrupted;
    install_interrupt_handler();  // until here Ctrl-C ends the program at once
    const flux::FluxResult result =
        arguments.relative_error
            ? flux::trace_flux_to(*arguments.relative_error, mesh, scene, box, species, materials.of_triangle,
                                  wedges, options)
            : flux::trace_flux(mesh, scene, box, species, materials.of_triangle, wedges, options);
    bar.reset();
    if (flux::leaks_too_much(result.leaked, result.emitted))
        throw NumericsError(fmt::format(
            "{}: {} of {} particles went through the surface: it has holes, overlaps, pieces turned "
            "inside out that are hidden from above or, with periodic sides, opposite ends that do "
            "not match",
            arguments.mesh, result.leaked, result.emitted));
    if (result.leaked > 0)
        fmt::print(stderr, "sidewall flux: {} of {} particles went through the surface\n", result.leaked,
                   result.emitted);
    if (!arguments.output.empty()) write_output(arguments.output, mesh, result);
    const Json json = summarise(arguments, mesh, box, result, bvh);
    if (!arguments.json.empty()) write_json(arguments.json, json);
    if (arguments.json != "-") print_summary(json);
    if (arguments.relative_error && !(result.relative_error <= *arguments.relative_error))
        throw NumericsError(fmt::format(
            "{}: relative error {:.3g} after {} rays, above the {:.3g} asked for{}: allow more rays with "
            "--rays or ask for less",
            arguments.mesh, result.relative_error, result.emitted, *arguments.relative_error,
            arguments.output.empty() && arguments.json.empty() ? "" : " (what they gave is written)"));
}

}  // namespace

void add_flux_command(CLI::App& program) {
    const auto arguments = std::make_shared<FluxArguments>();
    CLI::App& command =
        add_command(program, "flux", "Particle flux on a surface, by Monte Carlo ray tracing");
    add_option(command, "mesh", arguments->mesh, "MESH",
               "The surface: .vtp, .ply, .stl or .obj, normals out of the material, z up",
               {.required = true});
    add_option(command, "-o,--output", arguments->output, "FILE",
               "Write flux, flux_error and area: .vtp or .csv");
    add_option(command, "--rays", arguments->rays, "N",
               fmt::format("Source rays, rounded up to a multiple of 32 (default {:.0e}; with "
                           "--relative-error the most to spend, default {:.0e})",
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
