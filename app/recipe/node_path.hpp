#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// One part of a path such as `step[0].sticking` or `step."main etch".rate`.
struct PathPart {
    std::string key;
    std::vector<std::size_t> indices;
};

/// A step that a recipe has given a name.
struct NamedStep {
    std::string name;
    std::string path;  ///< e.g. "step[1].steps[0]"
};

/// \p path with a step's place instead of its name: "step.etch.duration" becomes "step[1].duration". Other paths
/// stay as they are.
/// \throws RecipeError that lists the names, if no step or several have that one.
std::string with_place_of_step(std::string_view path, std::span<const NamedStep> steps);

/// The start of the path of a step's keys by its name: `step.etch`, or `step."main etch"`.
std::string path_by_name(const std::string& name);

/// The recipe's steps that have names, those in loops too.
std::vector<NamedStep> named_steps(const toml::table& root);

/// Where the key of `key=value` ends: at the first = that is not in quotes; npos if there is none.
std::size_t end_of_key(std::string_view setting);

/// Parts of a path; empty if it is not one or has more than kMostKeyParts of them (recipe/reader.hpp).
std::vector<PathPart> split_path(std::string_view path);

/// The node at \p path below \p root, or nullptr.
const toml::node* find_node(const toml::table& root, std::string_view path);

/// Applies `key=value` to \p root before it is validated.
/// \throws RecipeError naming the override.
void apply_override(toml::table& root, const std::string& setting);

/// The number that a recipe's text, changed by \p overrides, has for a key such as `step[0].rate.Si`; nothing if it
/// leaves the key to its default or has no number there.
/// \throws RecipeError for what is no TOML.
std::optional<double> written_number(const std::string& text, const std::string& file,
                                     const std::vector<std::string>& overrides, const std::string& key);

}  // namespace sidewall::app
