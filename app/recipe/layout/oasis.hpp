#pragma once
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// What an OASIS file begins with.
inline constexpr std::string_view kOasisMagic = "%SEMI-OASIS\r\n";

/// Reads an OASIS 1.0 file (SEMI P39) from its bytes. Texts, properties and names of layers are skipped.
/// \param name  for messages.
/// \throws FileError for anything damaged, naming the byte, for what OASIS 1.0 leaves to others (XGEOMETRY), and for too
///         much (layout.hpp).
Layout parse_oasis(std::string_view bytes, const std::string& name);

}  // namespace sidewall::app
