#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace sidewall::surface {

/// All bytes of a file.
/// \throws FileError if it is missing, a folder or unreadable.
std::string read_whole_file(const std::filesystem::path& path);

/// Lets \p write make a file beside \p path, named `path.partial`, which is then renamed, so that no reader ever
/// sees half of it. If anything is thrown, the partial file is removed and the old one stays.
/// \throws whatever \p write throws; std::filesystem::filesystem_error if the file cannot be renamed.
void write_through_partial(const std::filesystem::path& path,
                           const std::function<void(const std::filesystem::path& partial)>& write);

/// Writes a file by write_through_partial; makes missing folders.
/// \throws IoError naming the path and the system's reason.
void write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace sidewall::surface
