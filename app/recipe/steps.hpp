#pragma once
#include <fmt/format.h>

#include <vector>

#include "app/recipe/node_path.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Keys of a loop; or the keys common to all steps, then those of the step's model and pattern.
std::vector<Key> keys_of(Step& step);

/// Keys of the step's model alone. Only read their targets.
std::vector<Key> model_keys(const Step& step);

/// Calls \p visit with every step, also those in loops, and its path such as "step[1].steps[0]".
template <class Steps, class Visit>
void each_step(Steps& steps, const Visit& visit, const std::string& path = "step") {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const std::string here = fmt::format("{}[{}]", path, i);
        visit(steps[i], here);
        each_step(steps[i].steps, visit, here + ".steps");
    }
}

/// All steps with a name, including those in loops.
std::vector<NamedStep> named_steps(const std::vector<Step>& steps);

/// Reads [[step]] into \p recipe and builds the steps' models. \pre domain, materials and layers are read.
/// \throws RecipeError.
void read_steps(const toml::table& root, Recipe& recipe);

}  // namespace sidewall::app
