#pragma once
#include <chrono>
#include <string>
#include <vector>

#include "app/common/processes.hpp"

// Other processes of this program: those that answer at once, and runs that outlive this process.
namespace sidewall::app {

/// Runs this program with other arguments and waits for its end. At most two run at a time; other calls wait.
/// \param arguments  without the program's name.
/// \param folder     descriptor of its working folder.
/// \param input      its standard input.
/// \param patience   time until it is killed; it is killed, too, when this process is asked to stop.
/// \throws NumericsError if the system refuses a process, IoError if its output is over 16 MB.
ProcessEnd run_self(const std::vector<std::string>& arguments, int folder, const std::string& input,
                    std::chrono::seconds patience);

/// Starts a program in a new session, so that it outlives this process and the terminal.
/// \param words   its command line; the name `sidewall` is this program.
/// \param folder  descriptor of its working folder.
/// \param log     descriptor that gets its standard output and error; negative: none.
/// \throws IoError if the system refuses a process.
void start_program(const std::vector<std::string>& words, int folder, int log);

/// Reaps the started processes that have ended, so that none stays a zombie; does not block.
void forget_ended();

}  // namespace sidewall::app
