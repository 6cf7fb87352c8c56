#pragma once
#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace sidewall::app {

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
