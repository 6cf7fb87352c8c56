#include "app/process/record/saved_wafer.hpp"

#include <fmt/format.h>

#include "app/common/files.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/process/wafer.hpp"
#include "levelset/meshes/contact_lines.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kAgain = "run the simulation again";

}  // namespace

std::optional<Result> wafer_of_checkpoint(const std::filesystem::path& folder) {
    if (!is_there(folder / "checkpoint.vdb")) return std::nullopt;
    const Recipe recipe = load_frame(folder / "recipe.toml");
    const RunState state = read_checkpoint(folder, recipe, kAgain).state;
    if (state.is_saved()) return std::nullopt;
    if (is_there(folder / "surface.pvd"))
        for (const SavedSurface& saved : saved_surfaces(folder))
            if (saved.number >= state.saved) return std::nullopt;  // after the checkpoint
    Result result;
    result.source = folder / "checkpoint.vdb";
    result.folder = folder;
    result.metadata = metadata_of(recipe, state.process_time());
    levelset::StackMeshes meshes =
        levelset::extract_materials(state.stack, levelset::extract_surface(state.stack));
    std::vector<double> material;
    material.reserve(meshes.surface.layer.size());
    for (const std::size_t layer : meshes.surface.layer)
        material.push_back(state.stack.layers[layer].material);
    result.surface = std::move(meshes.surface.mesh);
    result.surface.triangle_attributes.push_back({"material", 1, Scalar::int32, std::move(material)});
    for (std::size_t k = 0; k < meshes.interfaces.size(); ++k)
        if (!meshes.interfaces[k].triangles.empty())
            result.interfaces.push_back(
                interface_mesh(std::move(meshes.interfaces[k]), state.stack.layers[k].material));
    return result;
}

std::vector<Measure> measure_saved(const std::filesystem::path& folder, const Recipe& recipe,
                                   const std::optional<SavedSurface>& saved, bool anew) {
    const RunState state = read_checkpoint(folder, recipe, kAgain).state;
    // The last checkpoint of a run comes before its last surface.
    const bool last = saved && saved->number == state.stacks.size() && saved->time == state.process_time();
    if (!saved || last) return measure(recipe, state.stack, levelset::extract_surface(state.stack));
    if (saved->number >= state.stacks.size())
        throw FileError(fmt::format("{}: was saved after the last checkpoint: go on with the run first",
                                    saved->file.string()));
    const SavedStack& stack = state.stacks[saved->number];
    const std::vector<StepEnd>& ends = state.history.ends;
    if (!anew && !saved->after.empty() && stack.step > 0 && stack.step <= ends.size())
        return ends[stack.step - 1].measures;
    const levelset::MaterialStack wafer = stack_of_saved(folder, state, saved->number, domain_of(recipe));
    return measure(recipe, wafer, levelset::extract_surface(wafer));
}

}  // namespace sidewall::app
