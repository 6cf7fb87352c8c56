#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/toml.hpp"
#include "app/schema/units.hpp"

// Decks: chemistries with their sources, as files that steps name by the key `chemistry` (docs/chemistry.md).
namespace sidewall::app {

struct Deck {
    std::string name;  ///< name of the file without .toml
    std::filesystem::path file;
    std::string title, model;
    std::string holds;  ///< conditions under which the sources hold, in words, beyond those that are keys
    std::vector<std::string> sources;
    Units units;         ///< units of the deck's numbers
    toml::table tables;  ///< the whole file: step (keys), range (in which its sources hold), expected
};

/// The decks shipped with the program, by name.
/// \throws FileError, RecipeError naming file and line.
std::vector<Deck> shipped_decks();

/// Advice after an unknown deck's name: the nearest name, if any is near, and all names.
std::string deck_advice(const std::string& name, const std::vector<std::string>& names);

/// A recipe's tables as its steps are read: with \p overrides, and with keys from the decks that steps name
/// where a step lacks them, in the recipe's units. Numbers by material are kept only for materials that the
/// wafer can have. Nodes from a deck have its file and line.
///
/// \param file   the recipe's file; a user's decks are searched beside it.
/// \param notes  receives the decks used, keys outside their sources' range, and materials without numbers.
/// \throws RecipeError as parse_toml and apply_override; for an unknown deck, or one of another model.
toml::table recipe_tables(std::string_view text, const std::string& file,
                          const std::vector<std::string>& overrides, std::vector<std::string>& notes);

}  // namespace sidewall::app
