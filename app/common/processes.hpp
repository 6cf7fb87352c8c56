#pragma once
#include <sys/types.h>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "flux/shares.hpp"

// Threads of this process, its child processes, and the ranks that `mpirun -n N sidewall ...` has started
// together. Rank 0 prints and writes results for all ranks.
namespace sidewall::app {

/// The place of this process among those that mpirun has started.
struct Ranks {
    std::uint32_t rank = 0, count = 1;
    std::uint32_t on_this_machine = 1;
};

/// The rank and the number of processes that mpirun gave in the environment when the program began.
const Ranks& ranks();

/// Sets up a rank at the start of the program: ranks other than the first print nothing, each uses its share
/// of the machine's cores, and child processes do not see that mpirun started this one.
void begin_rank();

/// Joins the other ranks by MPI, until end_rank().
/// \returns how ranks share the rays of traces; one process has all. Each sum updates any_rank_interrupted().
/// \throws RecipeError if this installation has no MPI.
flux::Shares join_ranks();

/// Whether a signal had asked any rank to stop when the ranks last summed; the same on all ranks.
bool any_rank_interrupted();

/// Seconds that this rank has spent in sums over the ranks, including waiting for other ranks.
double seconds_in_sums();

/// Writes the error that ends the program to standard error. A rank other than the first waits two seconds:
/// mostly the first meets the same error, reports it and ends all. If this rank still runs, it writes, too.
/// \param exit_code  that the program will end with; other ranks than the first report no interruption.
void report_failure(const char* text, int exit_code);

/// Leaves the other ranks at the end of the program. If \p exit_code is an error, which other ranks may not
/// have met, it ends all of them.
/// \returns \p exit_code.
int end_rank(int exit_code);

/// The number of threads in force.
int thread_count();

/// Limits parallel loops to \p count threads; results do not depend on it.
/// \pre count >= 1.
void limit_threads(int count);

/// How a process ended.
struct ProcessEnd {
    int exit_code = 0;     ///< 128 plus its number if a signal ended it
    std::string output;    ///< the end of its standard output
    std::string messages;  ///< the end of its standard error
};

/// Starts a program: the name `sidewall` in \p words is this one.
/// \param folder   descriptor of its working folder; negative: that of this process.
/// \param files    descriptors that become its standard input, output and error; no other stays open.
/// \param outlive  it gets a session of its own; else SIGTERM when its parent ends for any reason (Linux).
/// \returns its process number; negative, with errno, if the system refuses one.
pid_t start_process(std::vector<std::string> words, int folder, const std::array<int, 3>& files,
                    bool outlive);

/// A child process that runs this program with other arguments. Ctrl-C at the terminal does not reach it.
class ChildProcess {
  public:
    /// \param arguments  without the program's name.
    /// \param folder     as in start_process().
    /// \param input      its standard input.
    /// \throws NumericsError if the system refuses a process.
    explicit ChildProcess(std::vector<std::string> arguments, int folder = -1, const std::string& input = "");
    /// Sends SIGTERM if it still runs, and waits for its end.
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    /// How it ended, once: nothing while it runs and at later calls.
    /// \param most  bytes of each of its outputs that are returned.
    std::optional<ProcessEnd> end(std::size_t most = 1 << 16);
    /// Sends a signal.
    void stop(int signal) const;

  private:
    pid_t process_ = -1;                    // -1: its end is known
    std::array<int, 3> files_{-1, -1, -1};  // files in memory with its input and outputs
};

}  // namespace sidewall::app
