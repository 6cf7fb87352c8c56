#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "app/common/json.hpp"

namespace sidewall::app {

/// The first entry that a summary lacks or holds with another type than runs write, e.g. "timing"; none if it is whole.
/// Readers check it first: a file in a folder may be damaged.
std::optional<std::string> missing_in_summary(const Json& summary);

/// Whether a summary says another version than this program's.
bool has_other_version(const Json& summary);

/// \throws FileError naming DIR/summary.json if \p summary, which was read there, lacks anything.
void require_whole(const Json& summary, const std::filesystem::path& folder);

/// DIR/summary.json if it is there, whole and of this version.
std::optional<Json> own_summary(const std::filesystem::path& folder);

/// DIR/summary.json of a run that has ended.
/// \throws FileError if it is missing, no JSON, or lacks anything.
Json read_whole_summary(const std::filesystem::path& folder);

}  // namespace sidewall::app
