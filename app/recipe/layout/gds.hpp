#pragma once
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// Parses a GDSII stream file. Texts, nodes and properties are skipped.
/// \param name  for messages.
/// \throws FileError with the byte for damaged files, and where limits are exceeded (layout.hpp).
Layout parse_gds(std::string_view bytes, const std::string& name);

}  // namespace sidewall::app
