#include "app/accuracy/accuracy_asked.hpp"

#include <fmt/format.h>

#include "app/common/text.hpp"
#include "app/recipe/figure_names.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

AskedAccuracy read_one(const std::string& text) {
    constexpr const char* kForm = "write MEASURE=BOUND or MEASURE=PERCENT%, e.g. depth=0.02 or depth=1%";
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw RecipeError(fmt::format("--accuracy {}: {}", text, kForm));
    AskedAccuracy asked{.measure = text.substr(0, equals), .text = text.substr(equals + 1)};
    std::string_view bound = trimmed(asked.text);
    asked.relative = bound.ends_with('%');
    if (asked.relative) bound = trimmed(bound.substr(0, bound.size() - 1));
    const auto number = finite_number(bound);
    if (!number) throw RecipeError(fmt::format("--accuracy {}: {} is no number: {}", text, bound, kForm));
    if (!(*number > 0.0)) throw RecipeError(fmt::format("--accuracy {}: must be greater than 0", text));
    constexpr double kPercent = 0.01;
    asked.bound = asked.relative ? kPercent * *number : *number;
    if (asked.relative && asked.bound >= 1.0)
        throw RecipeError(fmt::format("--accuracy {}: must be below 100 %", text));
    return asked;
}

}  // namespace

std::vector<AskedAccuracy> read_accuracy(const std::vector<std::string>& texts, Recipe& recipe) {
    std::vector<AskedAccuracy> all;
    for (const std::string& text : texts) {
        AskedAccuracy asked = read_one(text);
        want_figure(recipe, asked.measure, "--accuracy", text);
        for (const AskedAccuracy& other : all)
            if (other.measure == asked.measure)
                throw RecipeError(fmt::format("--accuracy {}: {} is asked for twice", text, asked.measure));
        all.push_back(std::move(asked));
    }
    return all;
}

}  // namespace sidewall::app
