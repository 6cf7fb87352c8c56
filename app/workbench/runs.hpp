#pragma once
#include <string>
#include <vector>

#include "app/common/json_fwd.hpp"
#include "app/common/processes.hpp"
#include "app/workbench/opened_folder.hpp"

// Runs of the opened folder, as the page lists, starts and stops them, and other processes of the program.
namespace sidewall::app {

/// Runs this program with other arguments and waits for its end, a minute at most: then, and when this process
/// is asked to stop, it is killed. At most two run at a time; other calls wait.
/// \param arguments  without the program's name.
/// \param folder     descriptor of its working folder.
/// \param input      its standard input.
/// \throws NumericsError if the system refuses a process, IoError if its output is over 16 MB.
ProcessEnd run_self(const std::vector<std::string>& arguments, int folder, const std::string& input);

/// Starts a program in a new session, so that it outlives this process and the terminal.
/// \param words   its command line; the name `sidewall` is this program.
/// \param folder  descriptor of its working folder.
/// \param log     descriptor that gets its standard output and error; negative: none.
/// \throws IoError if the system refuses a process.
void start_program(const std::vector<std::string>& words, int folder, int log);

/// Reaps the started processes that have ended, so that none stays a zombie; does not block.
void forget_ended();

/// A folder of results: {"path", "kind", "state": running, finished or stopped, "time", "total", "unit",
/// "stamp"}. The stamp changes when a file that the page shows changes.
Json run_json(const OpenedFolder& folder, const std::string& name);

/// The runs_table of the opened folder's results; files that are links are not read.
Json table_json(const OpenedFolder& folder);

/// The command line that starts or resumes a run, sweep or fit. The page asks with {"command", "recipe",
/// "output", "resume", "vary": [], "target": [], "target_profile": [], "set": []}.
/// \throws NotInside for a missing recipe, profile or folder; RecipeError for another command.
std::vector<std::string> command_words(const OpenedFolder& folder, const Json& asked);

/// Starts the command that the page asks for; NAME.log beside its folder gets its output. A resumed sweep or
/// fit takes recipe and options from its folder.
/// \throws as command_words.
void start_run(const OpenedFolder& folder, const Json& wanted);

/// Sends SIGTERM to the process that works in a folder of results, which stops it as Ctrl-C does.
/// \returns false if no such process runs on this machine.
bool stop_run(const OpenedFolder& folder, const std::string& name);

}  // namespace sidewall::app
