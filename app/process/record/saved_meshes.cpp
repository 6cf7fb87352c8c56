#include "app/process/record/saved_meshes.hpp"

#include <tbb/parallel_for.h>

#include "app/common/files.hpp"
#include "app/process/arriving/line_of_sight.hpp"
#include "app/process/arriving/rates.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "levelset/meshes/extract.hpp"

namespace sidewall::app {
namespace {

Attribute material_attribute(std::vector<double> values) {
    return {"material", 1, Scalar::int32, std::move(values)};
}

constexpr const char* kAgain = "run the simulation again";

}  // namespace

surface::MeshMetadata metadata_of(const Recipe& recipe, double time) {
    std::vector<std::string> names, colours;
    names.reserve(recipe.materials.size());
    colours.reserve(recipe.materials.size());
    for (const Material& m : recipe.materials) {
        names.push_back(m.name);
        colours.push_back(m.colour);
    }
    surface::MeshMetadata metadata{
        {{"length_unit", recipe.domain.length_unit}, {"time_unit", recipe.domain.time_unit}},
        {{"time", time}}};
    if (is_axial(recipe.domain)) metadata.texts.emplace_back("symmetry", "axial");
    surface::add_list(metadata, "materials", names);
    surface::add_list(metadata, "material_colours", colours);
    return metadata;
}

bool is_round_profile(const surface::MeshMetadata& metadata) {
    return std::ranges::count(metadata.texts, std::pair<std::string, std::string>("symmetry", "axial")) > 0;
}

TriangleMesh traced_mesh(const Model& model, const TracedSurface& surface) {
    const SurfaceFlux& arriving = *surface.arriving;
    TriangleMesh mesh = surface.traced();
    mesh.vertex_attributes.clear();
    mesh.triangle_attributes.clear();
    mesh.triangle_attributes.push_back(
        material_attribute({arriving.materials.begin(), arriving.materials.end()}));
    for (std::size_t k = 0; k < model.species.size(); ++k) {
        const auto names = flux::tally_names(model.species[k]);
        for (std::size_t tally = 0; tally < names.size(); ++tally) {
            const flux::TallyFlux& flux = arriving.trace->species[k].tally(tally);
            for (auto [attributes, field] : {std::pair(&mesh.triangle_attributes, &flux.triangle),
                                             {&mesh.vertex_attributes, &flux.vertex}}) {
                attributes->push_back({"flux_" + names[tally], 1, Scalar::float64, field->flux});
                attributes->push_back({"flux_error_" + names[tally], 1, Scalar::float64, field->error});
            }
        }
    }
    return mesh;
}

TriangleMesh result_mesh(const Model& model, const levelset::MaterialStack& stack,
                         const TracedSurface& surface, levelset::CutMesh cut) {
    TriangleMesh mesh = std::move(cut.mesh);
    std::vector<std::string> names;  // fluxes, then coverages
    for (const std::string& name : flux_names(model.species)) names.push_back("flux_" + name);
    const std::size_t n = mesh.triangles.size(), tallies = names.size();
    for (const std::string& name : model.coverages.names) names.push_back("coverage_" + name);
    std::vector<double> material(n), rate(n);
    std::vector<double> values(n * names.size());  // by triangle, then name
    std::vector<SurfacePoint> points(model.speeds ? n : 0);
    const std::vector<Vec3> traced_normals =
        surface.scene ? triangle_normals(surface.traced()) : std::vector<Vec3>{};
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t t) {
        const Vec3 centroid = triangle_centroid(mesh, t);
        SurfacePoint point{stack.layers[cut.layer[t]].material,
                           {},
                           area_vector(mesh, t).normalized(),
                           true,
                           {},
                           centroid,
                           surface.time};
        const std::span<double> here = std::span(values).subspan(t * names.size(), names.size());
        if (surface.scene) {
            surface::SurfaceHit hit = surface.scene->closest_point(centroid, stack.domain.spacing);
            if (!hit) hit = surface.scene->closest_point(centroid, 1e30);
            if (surface.arriving) interpolate(*surface.arriving, hit.triangle, hit.u, hit.v, here);
            if (model.visibility)
                point.visible = in_line_of_sight(surface, hit.point, traced_normals[hit.triangle],
                                                 *model.visibility, stack.domain.spacing);
        } else if (model.visibility) {
            point.visible =
                in_line_of_sight(surface, centroid, point.normal, *model.visibility, stack.domain.spacing);
        }
        point.flux = here.first(tallies);
        point.coverage = here.subspan(tallies);
        material[t] = point.material;
        if (model.speeds)
            points[t] = point;
        else
            rate[t] = model.speed(point);
    });
    if (model.speeds) rate = model.speeds(points);
    mesh.triangle_attributes.push_back(material_attribute(std::move(material)));
    for (std::size_t k = 0; k < names.size(); ++k) {
        std::vector<double> column(n);
        for (std::size_t t = 0; t < n; ++t) column[t] = values[t * names.size() + k];
        mesh.triangle_attributes.push_back({names[k], 1, Scalar::float64, std::move(column)});
    }
    mesh.triangle_attributes.push_back({"rate", 1, Scalar::float64, std::move(rate)});
    // Vertex errors belong to the traced mesh, so they apply only if this is the traced mesh.
    const bool same_vertices = !surface.simplified && !(stack.coarser && stack.layers.size() > 1);
    for (std::size_t k = 0; k < model.species.size() && same_vertices; ++k)
        for (std::size_t tally = 0; tally < flux::tally_count(model.species[k]); ++tally) {
            std::vector<double> error = surface.arriving->trace->species[k].tally(tally).vertex.error;
            for (const auto& [from, to, share] : cut.added)
                error.push_back(error[from] + share * (error[to] - error[from]));
            mesh.vertex_attributes.push_back({"flux_error_" + flux::tally_names(model.species[k])[tally], 1,
                                              Scalar::float64, std::move(error)});
        }
    return mesh;
}

TriangleMesh interface_mesh(TriangleMesh mesh, int material) {
    mesh.triangle_attributes.push_back(
        material_attribute(std::vector<double>(mesh.triangles.size(), material)));
    return mesh;
}

Result wafer_result(const Recipe& recipe, const levelset::MaterialStack& stack, double time) {
    Result result;
    result.metadata = metadata_of(recipe, time);
    levelset::StackMeshes meshes = levelset::extract_materials(stack, levelset::extract_surface(stack));
    std::vector<double> material;
    material.reserve(meshes.surface.layer.size());
    for (const std::size_t layer : meshes.surface.layer) material.push_back(stack.layers[layer].material);
    result.surface = std::move(meshes.surface.mesh);
    result.surface.triangle_attributes.push_back(material_attribute(std::move(material)));
    for (std::size_t k = 0; k < meshes.interfaces.size(); ++k)
        if (!meshes.interfaces[k].triangles.empty())
            result.interfaces.push_back(
                interface_mesh(std::move(meshes.interfaces[k]), stack.layers[k].material));
    widen_to_strip(recipe, result.surface);
    for (TriangleMesh& mesh : result.interfaces) widen_to_strip(recipe, mesh);
    return result;
}

std::optional<Result> wafer_of_checkpoint(const fs::path& folder) {
    if (!is_there(folder / "checkpoint.vdb")) return std::nullopt;
    const Recipe recipe = load_frame(folder / "recipe.toml");
    const RunState state = read_checkpoint(folder, recipe, kAgain).state;
    if (state.is_saved()) return std::nullopt;
    if (is_there(folder / "surface.pvd"))
        for (const SavedSurface& saved : saved_surfaces(folder))
            if (saved.number >= state.saved) return std::nullopt;  // saved after the checkpoint
    Result result = wafer_result(recipe, state.stack, state.process_time());
    result.source = folder / "checkpoint.vdb";
    result.folder = folder;
    return result;
}

std::vector<Measure> measure_saved(const fs::path& folder, const Recipe& recipe,
                                   const std::optional<SavedSurface>& saved, bool anew) {
    const RunState state = read_checkpoint(folder, recipe, kAgain).state;
    // A run writes its last checkpoint before its last surface.
    const bool last = saved && saved->number == state.stacks.size() && saved->time == state.process_time();
    if (!saved || last) return measure(recipe, state.stack, levelset::extract_surface(state.stack));
    if (saved->number >= state.stacks.size())
        throw FileError("{}: was saved after the last checkpoint: go on with the run first",
                        saved->file.string());
    const SavedStack& stack = state.stacks[saved->number];
    const std::vector<StepEnd>& ends = state.history.ends;
    if (!anew && !saved->after.empty() && stack.step > 0 && stack.step <= ends.size())
        return ends[stack.step - 1].measures;
    const levelset::MaterialStack wafer = stack_of_saved(folder, state, saved->number, domain_of(recipe));
    return measure(recipe, wafer, levelset::extract_surface(wafer));
}

}  // namespace sidewall::app
