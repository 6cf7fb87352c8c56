#include "app/study/measures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "app/recipe/sections.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Figures that a word of [metrology] measures stands for, where they are not of its name
// (results/metrology.cpp).
const std::vector<std::pair<std::string, std::vector<std::string>>> kFigures = {
    {"scallops", {"scallop_pitch", "scallop_depth"}},
    {"film", {"film_top", "film_side", "film_bottom", "step_coverage_side", "step_coverage_bottom"}},
    {"cd", {}},
};

constexpr std::string_view kCdAt = "cd_at_";

std::optional<double> cd_depth(const std::string& name) {
    double depth = 0.0;
    if (!name.starts_with(kCdAt)) return std::nullopt;
    const char* end = name.data() + name.size();
    const auto [stop, error] = std::from_chars(name.data() + kCdAt.size(), end, depth);
    const bool plain = error == std::errc() && stop == end && std::isfinite(depth) && depth >= 0.0;
    return plain && name == fmt::format("cd_at_{:g}", depth) ? std::optional(depth) : std::nullopt;
}

// What every run's summary has (process/summary.cpp); volumes only of materials that ever were on the wafer.
std::vector<std::string> figures_of_all(const Recipe& recipe) {
    std::vector<std::string> names{"mean_rate"};
    for (const Material& material : recipe.materials)
        for (const char* kind : {"added_volume_", "removed_volume_"}) names.push_back(kind + material.name);
    return names;
}

// The word that makes a run find the figure; empty: every run does.
std::optional<std::string> word_of(const Recipe& recipe, const std::string& figure) {
    for (const auto& [word, figures] : kFigures)
        if (std::find(figures.begin(), figures.end(), figure) != figures.end()) return word;
    if (cd_depth(figure)) return "cd";
    const auto always = figures_of_all(recipe);
    if (std::find(always.begin(), always.end(), figure) != always.end()) return "";
    const auto several = [&](const auto& entry) { return entry.first == figure; };
    if (std::any_of(kFigures.begin(), kFigures.end(), several)) return std::nullopt;
    const std::vector<std::string>& words = measure_names();
    return std::find(words.begin(), words.end(), figure) != words.end() ? std::optional(figure)
                                                                        : std::nullopt;
}

void add_once(auto& list, const auto& value) {
    if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

[[noreturn]] void refuse(const Recipe& recipe, const std::string& name, const std::string& option) {
    std::vector<std::string> known = measure_names();
    for (const auto& [word, figures] : kFigures) known.insert(known.end(), figures.begin(), figures.end());
    known.push_back("cd_at_0.5");
    const auto always = figures_of_all(recipe);
    known.insert(known.end(), always.begin(), always.end());
    throw RecipeError(fmt::format("{} {}: no run measures that{}", option, name,
                                  did_you_mean(": ", name, known, "; see sidewall models metrology")));
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
    if (const auto depth = cd_depth(name)) add_once(recipe.metrology.cd_depths, *depth);
    if (*wanted == "cd" && recipe.metrology.cd_depths.empty())
        throw RecipeError(
            fmt::format("{} {}: is measured at depths: name one, e.g. cd_at_0.5", option, name));
}

}  // namespace sidewall::app
