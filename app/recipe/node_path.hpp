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

/// Replaces a step's name in \p path by its place: "step.etch.duration" becomes "step[1].duration". Returns
/// other paths unchanged.
/// \throws RecipeError with the known names if no step or several steps have the name.
std::string with_place_of_step(std::string_view path, std::span<const NamedStep> steps);

/// Beginning of the path of a step's keys, by the step's name: `step.etch`, or `step."main etch"`.
std::string path_by_name(const std::string& name);

/// All steps of the recipe with a name, including those in loops.
std::vector<NamedStep> named_steps(const toml::table& root);

/// Position of the = that ends the key of `key=value`, the first outside quotes; npos if there is none.
std::size_t end_of_key(std::string_view setting);

/// Parts of a path. Empty if it is no path, or has more than kMostKeyParts parts (recipe/reader.hpp).
std::vector<PathPart> split_path(std::string_view path);

/// The node at \p path below \p root, or nullptr.
const toml::node* find_node(const toml::table& root, std::string_view path);

/// Applies `key=value` to \p root before it is validated.
/// \throws RecipeError naming the override.
void apply_override(toml::table& root, const std::string& setting);

/// The number that a recipe's text, after \p overrides, gives for a key such as `step[0].rate.Si`. No value
/// if the text has no number there, so that the default counts.
/// \throws RecipeError if the text is not TOML.
std::optional<double> written_number(const std::string& text, const std::string& file,
                                     const std::vector<std::string>& overrides, const std::string& key);

}  // namespace sidewall::app
