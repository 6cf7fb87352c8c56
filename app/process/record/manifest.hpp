#pragma once
#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// DIR/manifest.txt lists the files that runs have written into a folder, a name a line. What it does not list
// belongs to the user and is never removed.
namespace sidewall::app {

using FileNames = std::set<std::string, std::less<>>;

inline constexpr const char* kManifest = "manifest.txt";

/// The names in DIR/manifest.txt; absent if there is no such file of ours. Names that would lead out of the folder, and
/// a last one that is cut off, are left out.
/// \throws FileError if it cannot be read.
std::optional<FileNames> read_manifest(const std::filesystem::path& folder);

/// Writes DIR/manifest.txt.
/// \throws IoError.
void write_manifest(const std::filesystem::path& folder, const FileNames& names);

/// Adds names to DIR/manifest.txt; to be called before their files are made, so that a program that is killed
/// leaves none unlisted.
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

/// Removes what a killed program left half written of the files in \p names: NAME.partial and
/// NAME.PROCESS.partial.
/// \pre no other process writes to the folder.
void remove_partial_files(const std::filesystem::path& folder, const FileNames& names);

/// Folders in \p parent that a run to an accuracy has made beside its result: grid_N, seed_N, raw and raw_N with a manifest.
/// \throws FileError if a manifest is none.
std::vector<std::filesystem::path> accuracy_records(const std::filesystem::path& parent);

/// Removes from each of them the files that its manifest lists, and the folder if nothing else is in it.
/// \throws IoError if another process writes to one of them, or one cannot be emptied.
void remove_accuracy_records(const std::filesystem::path& parent);

}  // namespace sidewall::app
