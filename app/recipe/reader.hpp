#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/recipe.hpp"
#include "app/recipe/toml.hpp"

// From TOML nodes to fields; every message says where. Included by the recipe's own sources only.
namespace sidewall::app {

/// Parts of one dotted key or header. The TOML library makes and frees the tables they name by recursion.
inline constexpr std::size_t kMostKeyParts = 16;

/// The line, counted from 1, of the first key or header of more parts than that; 0 if there is none.
std::size_t line_of_deep_key(std::string_view text);

/// TOML of \p text; every node knows \p source, a file's name or an override.
/// \throws RecipeError with its line.
toml::table parse_toml(std::string_view text, const std::string& source);

/// Where a node was written: `file:line`, or the override that set it.
std::string place_of(const toml::node& node);

/// Throws the RecipeError `place: path = value: rule`.
[[noreturn]] void fail(const toml::node& node, std::string_view path, std::string_view rule);

/// Throws the RecipeError `place: path: rule` for something absent from \p table.
[[noreturn]] void fail_missing(const toml::node& table, std::string_view path, std::string_view rule);

/// What reading needs to know beside the TOML, and what it has to say.
struct Reading {
    const Materials& materials;       ///< those the recipe may name
    std::vector<std::string>& notes;  ///< takes what the recipe's author should know, e.g. of former names
};

/// Fills the targets of \p fields from \p table; those not in it keep their defaults.
///
/// \param path     of the table, e.g. "step[2]".
/// \param what     the table is, e.g. "a trench", for messages on unknown keys.
/// \param nested   keys that the caller reads itself.
/// \throws RecipeError for unknown keys, missing required ones, wrong types and broken rules.
void read_fields(const toml::table& table, const std::string& path, std::string_view what,
                 const std::vector<Field>& fields, const Reading& reading,
                 const std::vector<std::string>& nested = {});

/// Fills one target, if its key is in \p table, under its name or its former one.
void read_field(const toml::table& table, const std::string& path, const Field& field,
                const Reading& reading);

/// The tables of an array of tables, e.g. all [[layer]]; none if the key is absent.
/// \throws RecipeError if it is something else or empty.
std::vector<const toml::table*> tables_of(const toml::table& parent, std::string_view key,
                                          const std::string& path);

/// One part of a path such as `step[0].sticking`.
struct PathPart {
    std::string key;
    std::vector<std::size_t> indices;
};

/// Parts of a path; empty if it is not one or has more than kMostKeyParts of them.
std::vector<PathPart> split_path(std::string_view path);

/// The node at \p path below \p root, or nullptr.
const toml::node* find_node(const toml::table& root, std::string_view path);

/// Runs \p check of something read from \p table and adds the place to the KeyError it throws.
template <class Check>
auto located(const toml::table& table, const std::string& path, Check&& check) {
    try {
        return check();
    } catch (const KeyError& error) {
        const std::string key_path = path + "." + error.key;
        if (const toml::node* node = find_node(table, error.key)) fail(*node, key_path, error.rule);
        fail_missing(table, key_path, error.rule);
    }
}

/// Cells along the longer side of the domain: fewer hold no shape.
inline constexpr int kFewestAlong = 4;

/// Read [[layer]] and [[step]] into \p recipe, whose domain and materials are read.
void read_layers(const toml::table& root, Recipe& recipe);
void read_steps(const toml::table& root, Recipe& recipe);

/// Makes file names of the step's pattern absolute and checks that it makes sense on the grid.
void place_pattern(const toml::table& table, const std::string& path, Step& step, Recipe& recipe);

/// Applies `key=value` to \p root before it is validated.
/// \throws RecipeError naming the override.
void apply_override(toml::table& root, const std::string& setting);

}  // namespace sidewall::app
