#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace sidewall::surface {

/// All bytes of a file.
/// \throws FileError if it is missing, a folder or unreadable.
std::string read_whole_file(const std::filesystem::path& path);

/// Writes a file through a temporary one that is renamed, so that no reader ever sees half of it; makes
/// missing folders.
/// \throws IoError naming the path and the system's reason.
void write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace sidewall::surface
