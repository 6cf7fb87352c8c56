#pragma once
#include <filesystem>
#include <string>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// Finds that DIR is empty of results, or may be gone on with; removes what a killed program left half written.
/// \pre no other process writes there.
/// \param file    in DIR, e.g. sweep.json, with the digest of what made it.
/// \param what    is made there, e.g. "sweep".
/// \param plan    what \p file is to hold: "version" and "digest" among the rest.
/// \throws RecipeError if DIR holds another sweep or fit, a run, or this one and \p resume does not ask for it.
void open_batch_folder(const std::filesystem::path& folder, const std::string& file, const std::string& what,
                       const Json& plan, bool resume);

}  // namespace sidewall::app
