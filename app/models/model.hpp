#pragma once
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe.hpp"
#include "flux/tracer.hpp"
#include "surface/vec3.hpp"

namespace sidewall::app {

/// What a model sees of a point on the surface.
struct SurfacePoint {
    int material = 0;              ///< id of the material under the point
    std::span<const double> flux;  ///< in the order of flux_names, 1 on an open flat plane
    Vec3 normal = Vec3::UnitZ();   ///< unit, out of the material
    bool visible = true;  ///< the source is in line of sight; only asked where Model::visibility is set
};

/// A process model ready to run: which species to trace, and the speed they cause.
struct Model {
    std::vector<flux::Species> species;
    std::optional<Vec3> visibility;  ///< unit, towards the source, where line of sight counts
    bool depends_on_normal = false;  ///< V is V(n): needs a scheme with dissipation bounds
    std::function<double(const SurfacePoint&)> speed;  ///< length per time; positive grows, negative etches
    std::optional<int> deposit;                        ///< material id of the film that grows
    std::optional<double> max_speed;                   ///< bound of |V|, where fluxes do not enter
};

/// Names of all fluxes a model sees: the tallies of its species, one after the other (flux/species.hpp).
std::vector<std::string> flux_names(const std::vector<flux::Species>& species);

/// A model that recipes can name. Each lives in its own file of app/models/ and has a line in model.cpp.
struct ModelEntry {
    std::string name;
    std::string doc;
    std::vector<Key> keys;
    /// \throws KeyError where keys that are each right do not fit together.
    Model (*make)(const Values& values, const Materials& materials);
};

/// All models, in the order they are listed.
const std::vector<ModelEntry>& models();

/// nullptr if there is none of that name.
const ModelEntry* find_model(std::string_view name);

std::vector<std::string> model_names();

/// The model of a step, with its materials resolved. \pre the step is not a loop and comes from a parsed
/// recipe.
Model make_model(const Step& step, const Materials& materials);

/// The key `deposit`, which every model that can grow a film has.
Key deposit_key();

/// Id of the film named by `deposit`. \throws KeyError if \p grows, some speed being positive, and none is
/// named, or if one is named and nothing grows.
std::optional<int> film(const Values& values, const Materials& materials, bool grows);

}  // namespace sidewall::app
