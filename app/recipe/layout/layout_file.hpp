#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// Reads a layout from its bytes: GDSII, or OASIS 1.0, either packed by gzip, too, whatever it is called.
/// \param name  for messages.
/// \throws FileError for another format, over 1 GB unpacked, and as the format's parser.
Layout parse_layout(std::string_view bytes, const std::string& name);

/// Reads a layout from a file.
/// \throws FileError as parse_layout, if it cannot be read or if it is larger than 1 GB.
Layout read_layout(const std::filesystem::path& path);

}  // namespace sidewall::app
