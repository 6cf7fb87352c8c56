#pragma once
#include <filesystem>
#include <string_view>

namespace sidewall::app {

/// Writes \p text to \p path through a temporary file that is synced, verified and renamed: a reader never sees
/// half a file, and the old one stays if anything fails. Missing folders are made.
/// \throws IoError naming the path and the system's reason.
void write_file(const std::filesystem::path& path, std::string_view text);

/// Makes a folder and those above it, where they are missing.
/// \throws IoError naming it and the system's reason; the message ends with \p advice.
void make_folder(const std::filesystem::path& folder, std::string_view advice);

/// \throws IoError if a folder that the program has for itself is a link: what it writes would land elsewhere.
void refuse_link(const std::filesystem::path& folder);

/// Whether a file or folder exists; false, too, where that cannot be known.
bool is_there(const std::filesystem::path& path);

}  // namespace sidewall::app
