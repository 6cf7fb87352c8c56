#include "app/sweep/measures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "app/recipe/figure_names.hpp"
#include "app/recipe/sections.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

void add_once(auto& list, const auto& value) {
    if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

[[noreturn]] void refuse(const Recipe& recipe, const std::string& name, const std::string& option) {
    throw RecipeError(
        fmt::format("{} {}: no run measures that{}", option, name, nearest_figure(recipe, name)));
}

}  // namespace

bool is_figure(const Recipe& recipe, const std::string& name) {
    return word_of(recipe, name).has_value();
}

std::string example_of(const std::string& word) {
    return word == "film" ? "film_side" : word == "cd" ? "cd_at_0.5" : "scallop_depth";
}

void want_measure(Recipe& recipe, const std::string& name, const std::string& option) {
    const std::vector<std::string>& words = measure_names();
    const bool word = std::find(words.begin(), words.end(), name) != words.end();
    const auto wanted = word ? std::optional(name) : word_of(recipe, name);
    if (!wanted) refuse(recipe, name, option);
    if (!wanted->empty()) add_once(recipe.metrology.measures, *wanted);
    if (const auto figure = named_figure(name, recipe.materials)) {
        if (figure->kind == FigureKind::opening) add_once(recipe.metrology.cd_depths, figure->at);
        try {
            require_measure(recipe, name, option);
        } catch (const KeyError& error) {
            throw RecipeError(error.what());
        }
    }
    if (*wanted == "cd" && recipe.metrology.cd_depths.empty())
        throw RecipeError(
            fmt::format("{} {}: is measured at depths: name one, e.g. cd_at_0.5", option, name));
}

}  // namespace sidewall::app
