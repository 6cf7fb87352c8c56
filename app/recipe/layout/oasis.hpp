#pragma once
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// First bytes of an OASIS file.
inline constexpr std::string_view kOasisMagic = "%SEMI-OASIS\r\n";

/// Parses an OASIS 1.0 file (SEMI P39). Texts, properties and names of layers are skipped.
/// \param name  for messages.
/// \throws FileError with the byte for damaged files and for XGEOMETRY, which OASIS 1.0 leaves undefined; and
///         where limits are exceeded (layout.hpp).
Layout parse_oasis(std::string_view bytes, const std::string& name);

}  // namespace sidewall::app
