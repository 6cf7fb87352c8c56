#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "app/recipe/toml.hpp"

namespace sidewall::app {

/// One part of a path such as `step[0].sticking`.
struct PathPart {
    std::string key;
    std::vector<std::size_t> indices;
};

/// Whether TOML lets a key without quotes hold \p c.
bool key_character(char c);

/// Parts of a path; empty if it is not one or has more than kMostKeyParts of them (recipe/reader.hpp).
std::vector<PathPart> split_path(std::string_view path);

/// The node at \p path below \p root, or nullptr.
const toml::node* find_node(const toml::table& root, std::string_view path);

}  // namespace sidewall::app
