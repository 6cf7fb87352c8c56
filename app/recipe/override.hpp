#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// Applies `key=value` to \p root before it is validated.
/// \throws RecipeError naming the override.
void apply_override(toml::table& root, const std::string& setting);

/// The number that a recipe's text, changed by \p overrides, has for a key such as `step[0].rate.Si`; nothing if it
/// leaves the key to its default or has no number there.
/// \throws RecipeError for what is no TOML.
std::optional<double> written_number(const std::string& text, const std::string& file,
                                     const std::vector<std::string>& overrides, const std::string& key);

}  // namespace sidewall::app
