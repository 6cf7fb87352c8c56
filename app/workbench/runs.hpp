#pragma once
#include <optional>
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "app/workbench/opened_folder.hpp"

// Runs of the opened folder as its page lists, starts and stops them.
namespace sidewall::app {

/// A folder of results: {"path", "kind", "state": running, finished or stopped, "time", "total", "unit", "stamp"}; the stamp changes
/// when a file does that the page shows.
Json run_json(const OpenedFolder& folder, const std::string& name);

/// The folder's runs as runs_table has them, of those files that are no links.
Json table_json(const OpenedFolder& folder);

/// The words of a command line that starts or goes on with a run, a sweep or a fit as the page asks: {"command", "recipe", "output",
/// "resume", "vary": [], "target": [], "target_profile": [], "set": []}.
/// \throws NotInside for a recipe, profile or folder that is none; RecipeError for another command.
std::vector<std::string> command_words(const OpenedFolder& folder, const Json& asked);

/// Starts such a command; what it says is in a file beside its folder, NAME.log. A sweep or fit that is resumed is that of its
/// folder.
/// \throws as command_words.
void start_run(const OpenedFolder& folder, const Json& wanted);

/// Asks the process that works in a folder of results to stop, as Ctrl-C does.
/// \returns false if none does on this machine.
bool stop_run(const OpenedFolder& folder, const std::string& name);

}  // namespace sidewall::app
