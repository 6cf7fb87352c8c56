#pragma once
#include <chrono>
#include <string>
#include <vector>

// Other processes of this program: some answer at once, some run on their own.
namespace sidewall::app {

/// What a process that was asked has said.
struct SpokenAnswer {
    int exit_code = 0;     ///< 128 and more by a signal
    std::string output;    ///< on standard output
    std::string messages;  ///< on standard error
};

/// Runs this program with other arguments and waits for its answer. At most two are asked at a time; others wait.
/// \param arguments  without the program's name.
/// \param folder     that it works in: an open one.
/// \param input      that it reads.
/// \param patience   after which it is killed, as it is when this process is asked to stop.
/// \throws IoError if the system refuses a process, or the answer is over 16 MB.
SpokenAnswer ask_program(const std::vector<std::string>& arguments, int folder, const std::string& input,
                         std::chrono::seconds patience);

/// Starts a program in a session of its own, so that it outlives this process and the terminal.
/// \param words   its name first; `sidewall` is this program.
/// \param folder  that it works in: an open one.
/// \param log     takes what it says; its number as a file of this process.
/// \throws IoError if the system refuses a process.
void start_program(const std::vector<std::string>& words, int folder, int log);

/// Lets go of the started processes that have ended, of which the system keeps a record until then.
void forget_ended();

}  // namespace sidewall::app
