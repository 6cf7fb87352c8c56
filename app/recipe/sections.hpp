#pragma once
#include "app/recipe/recipe.hpp"

// The keys of the sections that a recipe has once, and of a material: the one place that names, bounds and
// documents them. Those of layers are in layers.hpp, those of steps in steps.hpp.
namespace sidewall::app {

/// A line of a layout along which a profile is simulated. A parsed recipe has its extent and outlines instead.
struct CutSection {
    std::string layer;      ///< "63/0": where it is drawn, as layer and datatype
    std::int64_t line = 0;  ///< which of the layer's, from 1; 0: the only one
};

std::vector<Key> keys_of(DomainSection& domain);
std::vector<Key> keys_of(CutSection& cut);
std::vector<Key> keys_of(GridSection& grid);
std::vector<Key> keys_of(StartSection& start);
std::vector<Key> keys_of(Material& material);
std::vector<Key> keys_of(FluxSection& flux);
std::vector<Key> keys_of(SimplifySection& simplify);
std::vector<Key> keys_of(levelset::AdvectionOptions& advection);
std::vector<Key> keys_of(OutputSection& output);
std::vector<Key> keys_of(MetrologySection& metrology);

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

/// The keys of a recipe that `--set` can change, each by its path such as `step[0].duration`. Of a list of tables within
/// a step the first stands for all.
std::vector<KeyDoc> settable_keys(Recipe recipe);

/// The keys of any recipe that `--set` can change; the first layer and the first step stand for all, too.
std::vector<KeyDoc> settable_keys();

}  // namespace sidewall::app
