#pragma once
#include "app/recipe/recipe.hpp"

// The keys of every section: the one place that names, bounds and documents them.
namespace sidewall::app {

std::vector<Field> fields(DomainSection& domain);
std::vector<Field> fields(GridSection& grid);
std::vector<Field> fields(StartSection& start);
std::vector<Field> fields(Material& material);
std::vector<Field> fields(Layer& layer);  ///< those of its shape
std::vector<Field> pattern_fields(
    Layer& pattern);                    ///< of a step's pattern: those of its shape, or all without one
std::vector<Field> fields(Step& step);  ///< those of a loop, or common to all models and then its model's
std::vector<Field> fields(FluxSection& flux);
std::vector<Field> fields(SimplifySection& simplify);
std::vector<Field> fields(levelset::AdvectionOptions& advection);
std::vector<Field> fields(OutputSection& output);
std::vector<Field> fields(MetrologySection& metrology);

/// Words that `shape` accepts.
const std::vector<std::string>& shape_names();

/// Words that [metrology] measures accepts (results/metrology.hpp).
const std::vector<std::string>& measure_names();

/// A section as `sidewall models` lists it.
struct SectionDoc {
    std::string name;    ///< what to ask for, e.g. "flux" or "layer trench"
    std::string header;  ///< as in a recipe, e.g. "[flux]"
    std::string doc;
    std::vector<KeyDoc> keys;
    std::string more = {};  ///< after the keys, in lines of its own
};

/// Every section, shape and model.
std::vector<SectionDoc> recipe_documentation();

/// The keys that `--set` can change, each by its path such as `step[0].duration`: those of a recipe, or of any.
/// Of a list of tables within a step the first stands for all; of any recipe's layers and steps, too.
std::vector<KeyDoc> settable_keys(Recipe recipe);
std::vector<KeyDoc> settable_keys();

}  // namespace sidewall::app
