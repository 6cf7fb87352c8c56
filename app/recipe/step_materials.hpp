#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// The materials that a step meets, and its keys' values for them.
namespace sidewall::app {

/// A step that takes time and the ids of the materials that can be on the wafer during it, its own film among them.
/// What a mask or a film hides counts, too: it may come to light.
struct StepMaterials {
    std::string path;  ///< in the recipe, e.g. "step[1].steps[0]"
    const Step* step;
    std::vector<int> ids;
};

/// All steps of \p recipe that take time, in its order and each once, whatever loops repeat. They live as long as the
/// recipe.
/// \param on_wafer  ids of materials that it begins with besides those of its layers.
std::vector<StepMaterials> materials_by_step(const Recipe& recipe, std::span<const int> on_wafer = {});

/// Refuses a step with a key by material that has no value, neither given nor published, for a material it meets. Its
/// own film is excepted: models that ask for such values grow and remove it by other laws.
/// \throws KeyError naming all such keys, their materials and what to write.
void require_values(const StepMaterials& here, const Materials& materials);

/// Materials that a key by material gives a value of their own, though the step does not meet them.
struct IdleValues {
    std::string key;  ///< in the step, e.g. "species[0].rate"
    std::vector<std::string> materials;
};

/// Such keys of a step; values that are the model's own, or those of all materials not named, do not count.
std::vector<IdleValues> idle_values(const StepMaterials& here, const Materials& materials);

/// The values of the models' keys by material for the materials of every step, a table a step, as comments of TOML.
std::string values_by_material(const Recipe& recipe);

/// The built-in materials with their colours, densities and the yields that models have for them, a line each.
std::string built_in_materials();

}  // namespace sidewall::app
