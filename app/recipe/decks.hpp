#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/toml.hpp"
#include "app/schema/units.hpp"

// Decks: chemistries with sources, as files that steps name by the key `chemistry` (docs/chemistry.md).
namespace sidewall::app {

struct Deck {
    std::string name;  ///< of its file, without .toml
    std::filesystem::path file;
    std::string title, model;
    std::string holds;  ///< in words: where its sources hold, the conditions that are no key among them
    std::vector<std::string> sources;
    Units units;         ///< of its numbers
    toml::table tables;  ///< all of the file: step, the keys that it gives one; range, where its sources
                         ///< hold; expected
};

/// \throws FileError, RecipeError naming file and line.
Deck read_deck(const std::filesystem::path& file);

/// The decks that came with the program, by name.
/// \throws as read_deck.
std::vector<Deck> shipped_decks();

/// What a message says after a name that no deck has: the one meant, if it is near, and all there are.
std::string deck_advice(const std::string& name, const std::vector<std::string>& names);

/// A recipe's tables as its steps are read: \p overrides applied, and the keys of the decks that steps name put in where the
/// step has none of its own, in the recipe's units. Of numbers by material only those are taken that the recipe's
/// wafer can have. Nodes from a deck know its file and line.
///
/// \param file   the recipe's; a user's own decks are sought beside it.
/// \param notes  takes what decks are used, keys outside the range of their sources, and materials they do not know.
/// \throws RecipeError as parse_toml and apply_override, for an unknown deck, and for one of another model than the step's.
toml::table recipe_tables(std::string_view text, const std::string& file,
                          const std::vector<std::string>& overrides, std::vector<std::string>& notes);

}  // namespace sidewall::app
