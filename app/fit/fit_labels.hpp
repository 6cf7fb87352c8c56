#pragma once
#include <string>
#include <vector>

#include "app/fit/fit.hpp"
#include "surface/error.hpp"

// A fit of several recipes calls each by its LABEL, its file's name without folder and .toml.
namespace sidewall::app {

/// Labels of the recipes, their file names; a single recipe has an empty one.
/// \throws RecipeError if two are equal.
std::vector<std::string> labels_of(const std::vector<std::string>& files);

/// Chooses the \p texts that concern a recipe: with its label, which is left out, or with none.
std::vector<std::string> own_texts(const std::vector<std::string>& texts,
                                   const std::vector<std::string>& labels, const std::string& label);

/// Checks that every text has a label, if there are several recipes.
/// \throws RecipeError naming the nearest label.
void require_labels(const char* option, const std::vector<std::string>& texts,
                    const std::vector<std::string>& labels);

/// An error message about one recipe, with the names of targets, keys and settings as the user wrote them; a message about
/// something that all recipes share gets the label in front.
std::string with_label(const std::string& message, const std::string& label, const FitOptions& options);

/// Calls \p read and puts the label into the message of a RecipeError, as with_label does.
auto about_recipe(const std::string& label, const FitOptions& options, const auto& read) {
    try {
        return read();
    } catch (const RecipeError& error) {
        throw RecipeError(with_label(error.what(), label, options));
    }
}

}  // namespace sidewall::app
