#pragma once
#include "app/recipe/recipe.hpp"

// Keys of a material and of the sections that occur once, with names, bounds and documentation. The keys of
// layers are in layers.hpp, those of steps in steps.hpp.
namespace sidewall::app {

/// A line in a layout along which a profile is simulated. Parsing turns it into extent and outlines.
struct CutSection {
    std::string layer;      ///< layer and datatype with the line, e.g. "63/0"
    std::int64_t line = 0;  ///< number of the line on that layer, from 1; 0: the only one
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
    std::string name;    ///< name on the command line, e.g. "flux" or "layer trench"
    std::string header;  ///< as in a recipe, e.g. "[flux]"
    std::string doc;
    std::vector<KeyDoc> keys;
    std::string more = {};  ///< text after the keys, on separate lines
};

/// Documentation of every section, shape and model.
std::vector<SectionDoc> recipe_documentation();

/// Keys of a recipe that `--set` can change, by path such as `step[0].duration`. In a list of tables within a
/// step, the first table stands for all.
std::vector<KeyDoc> settable_keys(Recipe recipe);

/// Keys of any recipe that `--set` can change; the first layer and step stand for all.
std::vector<KeyDoc> settable_keys();

}  // namespace sidewall::app
