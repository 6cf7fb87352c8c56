#pragma once
#include <filesystem>
#include <string>

namespace sidewall::surface {

/// All bytes of a file.
/// \throws FileError if it is missing, a folder, a pipe or a device, or unreadable.
std::string read_whole_file(const std::filesystem::path& path);

/// A path's extension in lower case, with its dot: ".vtp" of "Fin.VTP".
std::string lower_extension(const std::filesystem::path& path);

}  // namespace sidewall::surface
