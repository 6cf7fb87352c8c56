#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// DIR/manifest.txt lists the files that runs have written into a folder, one name a line. All other files
// belong to the user and are never removed.
namespace sidewall::app {

using FileNames = std::set<std::string, std::less<>>;

inline constexpr const char* kManifest = "manifest.txt";

/// The names in DIR/manifest.txt; absent without such a file of this program. Skips names that would lead out
/// of the folder, and an incomplete last line.
/// \throws FileError if it cannot be read.
std::optional<FileNames> read_manifest(const std::filesystem::path& folder);

/// Writes DIR/manifest.txt.
/// \throws IoError.
void write_manifest(const std::filesystem::path& folder, const FileNames& names);

/// Adds names to DIR/manifest.txt. To be called before their files are made: a program that is killed then
/// leaves no file unlisted.
/// \throws IoError.
void add_to_manifest(const std::filesystem::path& folder, const std::vector<std::string>& names);

/// The files that every run writes once.
const FileNames& run_file_names();

/// NNNN of surface_NNNN.vtp, interface_NNNN_K.vtp, traced_NNNN.vtp, profile_NNNN.csv and profile_NNNN_K.csv;
/// absent for other names.
std::optional<std::size_t> saved_number(std::string_view name);

/// Removes a file if it is there.
/// \throws IoError.
void remove_file(const std::filesystem::path& path);

/// Removes incomplete versions of the files in \p names that a killed program left: NAME.partial and
/// NAME.PROCESS.partial.
/// \pre no other process writes to the folder.
void remove_partial_files(const std::filesystem::path& folder, const FileNames& names);

/// Subfolders of \p parent made by a run to an accuracy: grid_N, seed_N, raw and raw_N with a manifest.
/// \throws FileError if a manifest cannot be read.
std::vector<std::filesystem::path> accuracy_records(const std::filesystem::path& parent);

/// Removes from each of these folders the files that its manifest lists, and the folder if it is then empty.
/// \throws IoError if another process writes to a folder, or a file cannot be removed.
void remove_accuracy_records(const std::filesystem::path& parent);

}  // namespace sidewall::app
