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

void want_figure(Recipe& recipe, const std::string& name, const std::string& option,
                 const std::string& text) {
    want_measure(recipe, name, option);
    if (is_figure(recipe, name)) return;
    throw RecipeError(fmt::format("{} {}: {} stands for several figures: name one, e.g. {}", option, text,
                                  name,
                                  name == "film" ? "film_side"
                                  : name == "cd" ? "cd_at_0.5"
                                                 : "scallop_depth"));
}

}  // namespace sidewall::app
