#include "app/run_writer.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <fstream>
#include <regex>
#include <sstream>

#include "app/commands.hpp"
#include "app/metrology.hpp"
#include "app/result.hpp"
#include "levelset/extract.hpp"
#include "levelset/layer_depths.hpp"
#include "surface/cut.hpp"
#include "surface/error.hpp"
#include "surface/file.hpp"
#include "surface/mesh_io.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

// Everything a run writes but its recipe, so that a new one leaves nothing of an old one behind.
bool is_ours(const std::string& name) {
    static const std::regex names(
        R"((surface|traced)_\d{4,}\.vtp|interface_\d{4,}_\d+\.vtp|profile_\d{4,}(_\d+)?\.csv|)"
        R"(summary\.json|timeline\.csv|surface\.pvd|checkpoint\.vdb)");
    return std::regex_match(name, names);
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

surface::MeshMetadata metadata(const Recipe& recipe, double time) {
    std::string names, colours;
    for (const Material& m : recipe.materials) {
        names += (names.empty() ? "" : ",") + m.name;
        colours += (colours.empty() ? "" : ",") + m.colour;
    }
    return {{{"length_unit", recipe.domain.length_unit},
             {"time_unit", recipe.domain.time_unit},
             {"materials", names},
             {"material_colours", colours}},
            {{"time", time}}};
}

Attribute material_attribute(std::vector<double> values) {
    return {"material", 1, Scalar::int32, std::move(values)};
}

// Fluxes, rate and material of the traced mesh's triangles, as counted there.
TriangleMesh traced_mesh(const Model& model, const SurfaceFlux& surface) {
    TriangleMesh mesh = surface.traced();
    mesh.vertex_attributes.clear();
    mesh.triangle_attributes.clear();
    mesh.triangle_attributes.push_back(
        material_attribute({surface.materials.begin(), surface.materials.end()}));
    for (std::size_t k = 0; k < model.species.size(); ++k) {
        const auto names = flux::tally_names(model.species[k]);
        for (std::size_t tally = 0; tally < names.size(); ++tally) {
            const flux::TallyFlux& flux = surface.fluxes[k].tally(tally);
            const auto add = [&](const std::string& name, const flux::FluxField& field) {
                mesh.triangle_attributes.push_back({"flux_" + name, 1, Scalar::float64, field.flux});
                mesh.triangle_attributes.push_back({"flux_error_" + name, 1, Scalar::float64, field.error});
            };
            add(names[tally], flux.triangle);
            for (const auto& [name, values] :
                 {std::pair("flux_", &flux.vertex.flux), {"flux_error_", &flux.vertex.error}})
                mesh.vertex_attributes.push_back({name + names[tally], 1, Scalar::float64, *values});
        }
    }
    return mesh;
}

// The extracted surface with what each triangle's centroid receives and does.
TriangleMesh result_mesh(const Model& model, const levelset::MaterialStack& stack,
                         const SurfaceFlux& surface) {
    TriangleMesh mesh = surface.raw;
    std::vector<std::string> names;  // of fluxes, then coverages
    for (const std::string& name : flux_names(model.species)) names.push_back("flux_" + name);
    const std::size_t n = mesh.triangles.size(), tallies = names.size();
    for (const std::string& name : model.coverages.names) names.push_back("coverage_" + name);
    std::vector<double> material(n), rate(n);
    std::vector<std::vector<double>> values(names.size(), std::vector<double>(n));
    const std::vector<Vec3> traced_normals =
        surface.scene ? triangle_normals(surface.traced()) : std::vector<Vec3>{};
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t t) {
        const Vec3 centroid = triangle_centroid(mesh, t);
        SurfacePoint point{
            levelset::exposed_material(stack, centroid), {}, area_vector(mesh, t).normalized(), true};
        std::vector<double> here(names.size());
        if (surface.scene) {
            surface::SurfaceHit hit = surface.scene->closest_point(centroid, stack.domain.spacing);
            if (!hit) hit = surface.scene->closest_point(centroid, 1e30);
            interpolate(surface, hit.triangle, hit.u, hit.v, here);
            for (std::size_t k = 0; k < names.size(); ++k) values[k][t] = here[k];
            if (model.visibility)
                point.visible = visible(surface, hit.point, traced_normals[hit.triangle], *model.visibility,
                                        stack.domain.spacing);
        }
        point.flux = std::span(here).first(tallies);
        point.coverage = std::span(here).subspan(tallies);
        material[t] = point.material;
        rate[t] = model.speed(point);
    });
    mesh.triangle_attributes.push_back(material_attribute(std::move(material)));
    for (std::size_t k = 0; k < names.size(); ++k)
        mesh.triangle_attributes.push_back({names[k], 1, Scalar::float64, std::move(values[k])});
    mesh.triangle_attributes.push_back({"rate", 1, Scalar::float64, std::move(rate)});
    // The traced mesh has its errors; here they stand if it is this one.
    for (std::size_t k = 0; k < model.species.size() && !surface.simplified; ++k)
        for (std::size_t tally = 0; tally < flux::tally_count(model.species[k]); ++tally)
            mesh.vertex_attributes.push_back({"flux_error_" + flux::tally_names(model.species[k])[tally], 1,
                                              Scalar::float64, surface.fluxes[k].tally(tally).vertex.error});
    return mesh;
}

Json number(double value) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
}

}  // namespace

RunWriter::RunWriter(const RunOptions& options, const Recipe& recipe, const RunState& state)
    : options_(options), recipe_(recipe) {
    std::error_code failure;
    fs::create_directories(options.output, failure);
    if (failure)
        throw IoError(fmt::format("{}: cannot make the folder: {}; choose another with -o",
                                  options.output.string(), failure.message()));
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

bool RunWriter::due(const RunState& state) const {
    if (recipe_.output.every) return state.time >= static_cast<double>(state.saved) * *recipe_.output.every;
    return state.time == state.step_start;
}

void RunWriter::save(RunState& state, const Model& model, const SurfaceFlux& surface) {
    {
        const PhaseClock clock(state.timing.output);
        const auto meta = metadata(recipe_, state.time);
        int part = 0;
        const auto write = [&](const std::string& name, const TriangleMesh& mesh) {
            surface::write_mesh(options_.output / name, mesh, meta);
            state.files.push_back(Json{{"time", state.time}, {"part", part++}, {"file", name}});
        };
        const std::string number = fmt::format("{:04}", state.saved);
        write("surface_" + number + ".vtp", result_mesh(model, state.stack, surface));
        for (std::size_t k = 0; k + 1 < state.stack.layers.size(); ++k) {
            const levelset::Layer& layer = state.stack.layers[k];
            TriangleMesh mesh = levelset::extract_surface(*layer.phi, state.stack.domain);
            if (mesh.triangles.empty()) continue;  // etched away
            mesh.triangle_attributes.push_back(
                material_attribute(std::vector<double>(mesh.triangles.size(), layer.material)));
            write(fmt::format("interface_{}_{}.vtp", number, k), mesh);
        }
        if (surface.simplified) write("traced_" + number + ".vtp", traced_mesh(model, surface));
        const auto planes = profile_planes(recipe_);
        for (std::size_t k = 0; k < planes.size(); ++k) {
            const std::string name =
                k == 0 ? fmt::format("profile_{}.csv", number) : fmt::format("profile_{}_{}.csv", number, k);
            surface::write_profile_csv(options_.output / name, surface::cut_by_plane(surface.raw, planes[k]),
                                       planes[k]);
        }
        ++state.saved;
        write_pvd(state);
    }
    checkpoint(state);
}

void RunWriter::write_pvd(const RunState& state) const {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
        "  <Collection>\n";
    for (const Json& entry : state.files)
        text += fmt::format("    <DataSet timestep=\"{}\" part=\"{}\" file=\"{}\"/>\n",
                            entry["time"].get<double>(), entry["part"].get<int>(),
                            entry["file"].get<std::string>());
    write_file(options_.output / "surface.pvd", text + "  </Collection>\n</VTKFile>\n");
}

void RunWriter::record(RunState& state, const Step& step, const SurfaceFlux& surface, double dt,
                       double speed) {
    const PhaseClock clock(state.timing.output);
    const fs::path path = options_.output / "timeline.csv";
    const auto& traced = surface.traced();
    std::uint64_t segments = 0, leaked = 0;
    double error = 0.0;
    for (const auto& flux : surface.fluxes) {
        if (flux.pass_place == 0) segments += flux.segments;
        leaked += flux.leaked;
        error = std::max(error, flux.relative_error);
    }
    // Fluxes of an earlier time step have no error of their own.
    const bool reused = surface.fluxes.empty() && !surface.wedge_flux.empty();
    std::string row = fmt::format(
        "{},{},{:.9g},{:.9g},{:.9g},{},{},{},{},{},{},{}", state.step + 1, field(step.name), state.time, dt,
        speed, surface.raw.vertices.size(), surface.raw.triangles.size(), traced.vertices.size(),
        traced.triangles.size(), segments, leaked, reused ? std::string() : fmt::format("{:.6g}", error));
    const std::vector<Measure> measures = measure(recipe_, state.stack, surface.raw);
    for (const Measure& m : measures)  // none of something that is not there
        row += std::isfinite(m.value) ? fmt::format(",{:.9g}", m.value) : ",";
    std::ofstream out(path, std::ios::app | std::ios::binary);
    if (state.rows == 0) out << timeline_header(recipe_, measures);
    out << row << "\n";
    out.flush();
    if (!out) throw IoError(fmt::format("{}: cannot write; check space and permissions", path.string()));
    ++state.rows;
}

void RunWriter::checkpoint(const RunState& state) const {
    save_state(options_.output, recipe_, state);
}

Json RunWriter::finish(const RunState& state, const std::vector<Step>& steps, const SurfaceFlux& surface) {
    Json summary{{"version", SIDEWALL_VERSION},
                 {"recipe", recipe_.file},
                 {"seed", recipe_.flux.seed},
                 {"threads", thread_count()},
                 {"length_unit", recipe_.domain.length_unit},
                 {"time_unit", recipe_.domain.time_unit},
                 {"grid_spacing", state.stack.domain.spacing},
                 {"time", state.time},
                 {"time_steps", state.time_step},
                 {"steps", Json::array()},
                 {"timing", to_json(state.timing)}};
    for (std::size_t k = 0; k < steps.size(); ++k)
        summary["steps"].push_back(Json{{"name", steps[k].name},
                                        {"model", steps[k].model},
                                        {"duration", steps[k].duration},
                                        {"time_steps", state.time_steps[k]}});
    const auto sizes = [](const TriangleMesh& mesh) {
        return Json{{"vertices", mesh.vertices.size()}, {"triangles", mesh.triangles.size()}};
    };
    summary["mesh"] = Json{{"raw", sizes(surface.raw)}, {"simplified", sizes(surface.traced())}};
    summary["flux"] = Json::array();
    for (const auto& flux : surface.fluxes)
        summary["flux"].push_back(Json{{"rays", flux.emitted},
                                       {"segments", flux.segments},
                                       {"pass_species", flux.pass_species},
                                       {"pass_place", flux.pass_place},
                                       {"leaked", flux.leaked},
                                       {"relative_error", number(flux.relative_error)}});
    summary["metrology"] = Json::object();
    summary["metrology_units"] = Json::object();
    const auto report = [&](const std::string& name, double value, const std::string& unit) {
        summary["metrology"][name] = number(value);
        summary["metrology_units"][name] = unit;
    };
    for (const Measure& m : measure(recipe_, state.stack, surface.raw)) report(m.name, m.value, m.unit);
    // Against the recipe's layers at time 0.
    const std::size_t materials = recipe_.materials.size();
    const std::vector<double> before = material_volumes(initial_state(recipe_).stack, materials),
                              after = material_volumes(state.stack, materials);
    double grown = 0.0;
    for (std::size_t m = 0; m < materials; ++m) {
        const double change = after[m] - before[m];
        grown += change;
        if (before[m] == 0.0 && after[m] == 0.0) continue;
        const std::string& name = recipe_.materials[m].name;
        report("added_volume_" + name, std::max(0.0, change), recipe_.domain.length_unit + "^3");
        report("removed_volume_" + name, std::max(0.0, -change), recipe_.domain.length_unit + "^3");
    }
    // Of the wafer as a whole: growth if positive, etching if negative.
    if (state.time > 0.0)
        report("mean_rate", grown / (recipe_.domain.extent[0] * recipe_.domain.extent[1] * state.time),
               recipe_.domain.length_unit + "/" + recipe_.domain.time_unit);
    if (!surface.coverage.empty())
        summary["coverage"] = Json{{"traces", surface.iterations}, {"mean_change", surface.coverage_change}};
    write_json((options_.output / "summary.json").string(), summary);
    return summary;
}

}  // namespace sidewall::app
