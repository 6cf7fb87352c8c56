#pragma once
#include <string>
#include <vector>

#include "app/fit/fit.hpp"
#include "surface/error.hpp"

// A fit of several recipes calls each by its LABEL, its file's name without folder and .toml.
namespace sidewall::app {

/// Labels of the recipes; an empty one of a single recipe.
/// \throws RecipeError if two are alike.
std::vector<std::string> labels_of(const std::vector<std::string>& files);

/// What of \p texts concerns a recipe, without its label: all that has none, and what has its own.
std::vector<std::string> own_texts(const std::vector<std::string>& texts,
                                   const std::vector<std::string>& labels, const std::string& label);

/// \throws RecipeError naming the nearest label for what does not say of which of several recipes it is.
void require_labels(const char* option, const std::vector<std::string>& texts,
                    const std::vector<std::string>& labels);

/// A message on a recipe by itself, with the names of targets, keys and settings as the user wrote them; what all recipes share
/// gets the label in front, to say which of them refused it.
std::string with_label(const std::string& message, const std::string& label, const FitOptions& options);

/// What \p read returns; with_label of what it throws as a RecipeError.
auto about_recipe(const std::string& label, const FitOptions& options, const auto& read) {
    try {
        return read();
    } catch (const RecipeError& error) {
        throw RecipeError(with_label(error.what(), label, options));
    }
}

}  // namespace sidewall::app
