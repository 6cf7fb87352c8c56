#pragma once
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// Reads a GDSII stream file from its bytes. Texts, nodes and properties are skipped.
/// \param name  for messages.
/// \throws FileError for anything damaged, naming the byte, and for too much (layout.hpp).
Layout parse_gds(std::string_view bytes, const std::string& name);

}  // namespace sidewall::app
