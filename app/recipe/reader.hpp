#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/node_path.hpp"
#include "app/recipe/recipe.hpp"

// Reads TOML into the targets of keys. Every message names the place.
namespace sidewall::app {

/// Most parts of a dotted key or header: the TOML library creates and frees the tables they name recursively.
inline constexpr std::size_t kMostKeyParts = 16;

/// First line, from 1, with a key or header of more than kMostKeyParts parts; 0 if there is none.
std::size_t line_of_deep_key(std::string_view text);

/// Parses \p text. Its nodes remember \p source, which is a file's name or an override.
/// \throws RecipeError with the line.
toml::table parse_toml(std::string_view text, const std::string& source);

/// The place where a node was written: `file:line`, or the override that set it.
std::string place_of(const toml::node& node);

/// Throws the RecipeError `place: path = value: rule`; with more arguments fmt formats the rule.
[[noreturn]] void fail(const toml::node& node, std::string_view path, std::string_view rule);
template <class First, class... Rest>
[[noreturn]] void fail(const toml::node& node, std::string_view path, fmt::format_string<First, Rest...> rule,
                       First&& first, Rest&&... rest) {
    fail(node, path, fmt::format(rule, std::forward<First>(first), std::forward<Rest>(rest)...));
}

/// Throws the RecipeError `place: path: rule` for something absent from \p table.
[[noreturn]] void fail_missing(const toml::node& table, std::string_view path, std::string_view rule);

/// Context of reading: known materials, and a list for notes.
struct Reading {
    const Materials& materials;       ///< materials that the recipe may name
    std::vector<std::string>& notes;  ///< receives notes for the user, e.g. on former names of keys
};

/// Fills the targets of \p keys from \p table. Keys that it lacks keep their defaults.
///
/// \param path     path of the table, e.g. "step[2]".
/// \param what     what the table is, e.g. "a trench", for messages on unknown keys.
/// \param nested   further keys, which the caller reads.
/// \throws RecipeError for unknown keys, missing required ones, wrong types and broken rules.
void read_keys(const toml::table& table, const std::string& path, std::string_view what,
               const std::vector<Key>& keys, const Reading& reading,
               const std::vector<std::string>& nested = {});

/// Fills the target of one key if \p table has it, under its name or its former name.
void read_key(const toml::table& table, const std::string& path, const Key& key, const Reading& reading);

/// The tables of an array of tables, e.g. all [[layer]]; none if \p parent has no such key.
/// \throws RecipeError if it is no array of tables, or empty.
std::vector<const toml::table*> tables_of(const toml::table& parent, std::string_view key,
                                          const std::string& path);

/// Runs \p check on what was read from \p table; adds the place to a KeyError that it throws.
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

/// Fewest cells along the domain's longer side: fewer hold no shape.
inline constexpr int kFewestAlong = 4;

}  // namespace sidewall::app
