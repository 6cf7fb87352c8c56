#pragma once
#include <sys/types.h>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "flux/shares.hpp"

// Threads of this process, the processes that it starts, and those that `mpirun -n N sidewall ...` has
// started together, of which rank 0 speaks and writes for all.
namespace sidewall::app {

/// The place of this process among those that mpirun has started.
struct Ranks {
    std::uint32_t rank = 0, count = 1;
    std::uint32_t on_this_machine = 1;
};

/// The rank and the number of processes that mpirun gave in the environment when the program began.
const Ranks& ranks();

/// At the start of the program: ranks but the first fall silent, and each takes its part of the machine's cores as its
/// threads; children of this process will be alone.
void begin_rank();

/// Joins the other ranks by MPI, until end_rank.
/// \returns how they share traces; its sums also agree on what any_rank_interrupted says. One process alone: its own.
/// \throws RecipeError if this installation has no MPI.
flux::Shares join_ranks();

/// Whether a signal had asked any rank to stop by the last sum: the same on all ranks.
bool any_rank_interrupted();

/// Seconds that this rank has spent in sums, waiting for others included.
double seconds_in_sums();

/// Writes the error that ends the program to standard error. A rank other than the first leaves that to the first, which mostly
/// meets the same error, and speaks if it is still alive two seconds later.
/// \param exit_code  that the program will end with; an interruption all ranks agree on.
void tell_failure(const char* text, int exit_code);

/// At the end of the program, which ends with \p exit_code; if that is an error which other ranks may not have met,
/// all of them end here.
/// \returns \p exit_code.
int end_rank(int exit_code);

/// The number of threads in force.
int thread_count();

/// Lets parallel loops use no more than \p count threads from now on; results do not depend on it.
/// \pre count >= 1.
void limit_threads(int count);

/// The end of a process.
struct ProcessEnd {
    int exit_code = 0;   ///< 128 and more by a signal
    std::string output;  ///< what it said on standard output and standard error
};

/// A copy of this program that runs beside it with other arguments. It reads nothing, a Ctrl-C at the terminal
/// does not reach it, and when its parent ends, however that ends, it is asked to stop (Linux).
class ChildProcess {
  public:
    /// \param arguments  without the program's name.
    /// \throws NumericsError if the system refuses a process.
    explicit ChildProcess(const std::vector<std::string>& arguments);
    /// Stops it, if it still runs, and waits for that.
    ~ChildProcess();
    ChildProcess(ChildProcess&& other) noexcept;
    ChildProcess& operator=(ChildProcess&& other) noexcept;
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    /// Nothing while it runs; asks only once after that.
    std::optional<ProcessEnd> end();
    /// Sends SIGTERM.
    void ask_to_stop() const;

  private:
    pid_t process_ = -1;  // none: ended
    int output_ = -1;     // a file in memory
};

}  // namespace sidewall::app
