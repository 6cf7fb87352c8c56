#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/node_path.hpp"
#include "app/recipe/recipe.hpp"

// From TOML text to the members that keys fill; every message says where.
namespace sidewall::app {

/// The most parts of one dotted key or header: the TOML library makes and frees the tables they name by recursion.
inline constexpr std::size_t kMostKeyParts = 16;

/// The line, counted from 1, of the first key or header of more parts than that; 0 if there is none.
std::size_t line_of_deep_key(std::string_view text);

/// Parses \p text; every node knows \p source, a file's name or an override.
/// \throws RecipeError with its line.
toml::table parse_toml(std::string_view text, const std::string& source);

/// The place where a node was written: `file:line`, or the override that set it.
std::string place_of(const toml::node& node);

/// Throws the RecipeError `place: path = value: rule`.
[[noreturn]] void fail(const toml::node& node, std::string_view path, std::string_view rule);

/// Throws the RecipeError `place: path: rule` for something absent from \p table.
[[noreturn]] void fail_missing(const toml::node& table, std::string_view path, std::string_view rule);

/// The context of reading beside the TOML: known materials, and a list for notes.
struct Reading {
    const Materials& materials;       ///< those the recipe may name
    std::vector<std::string>& notes;  ///< takes what the recipe's author should know, e.g. of former names
};

/// Fills the targets of \p keys from \p table; those not in it keep their defaults.
///
/// \param path     of the table, e.g. "step[2]".
/// \param what     the table is, e.g. "a trench", for messages on unknown keys.
/// \param nested   keys that the caller reads itself.
/// \throws RecipeError for unknown keys, missing required ones, wrong types and broken rules.
void read_keys(const toml::table& table, const std::string& path, std::string_view what,
               const std::vector<Key>& keys, const Reading& reading,
               const std::vector<std::string>& nested = {});

/// Fills the target of one key, if it is in \p table, under its name or its former one.
void read_key(const toml::table& table, const std::string& path, const Key& key, const Reading& reading);

/// The tables of an array of tables, e.g. all [[layer]]; none if the key is absent.
/// \throws RecipeError if it is something else or empty.
std::vector<const toml::table*> tables_of(const toml::table& parent, std::string_view key,
                                          const std::string& path);

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

/// The fewest cells along the longer side of the domain that hold a shape.
inline constexpr int kFewestAlong = 4;

}  // namespace sidewall::app
