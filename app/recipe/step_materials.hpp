#pragma once
#include <span>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

// Materials that can be on the wafer in a step, and the values of its keys for them.
namespace sidewall::app {

/// A step that takes time, with the ids of the materials that can be on the wafer during it, including its
/// film. Materials hidden under others count, as they may become exposed.
struct StepMaterials {
    std::string path;  ///< its path in the recipe, e.g. "step[1].steps[0]"
    const Step* step;
    std::vector<int> ids;
};

/// All steps of \p recipe that take time, in its order, each once whatever loops repeat. They point into it.
/// \param on_wafer  ids of materials present at the start in addition to those of the layers.
std::vector<StepMaterials> materials_by_step(const Recipe& recipe, std::span<const int> on_wafer = {});

/// Refuses a step if a key by material has no value for a material that can be on the wafer. The step's film
/// is excepted: models with such keys grow and remove it by other laws.
/// \throws KeyError naming all such keys, their materials and what to write.
void require_values(const StepMaterials& here, const Materials& materials);

/// Materials with values in a key by material that cannot be on the wafer in the step.
struct IdleValues {
    std::string key;  ///< path in the step, e.g. "species[0].rate"
    std::vector<std::string> materials;
};

/// All such keys of a step. Values equal to the model's defaults or to the key's default do not count.
std::vector<IdleValues> idle_values(const StepMaterials& here, const Materials& materials);

/// The values by material in all steps, one table a step, as TOML comments.
std::string values_by_material(const Recipe& recipe);

/// The built-in materials with colours, densities and the models' yields, one a line.
std::string built_in_materials();

}  // namespace sidewall::app
