#include "app/workbench/launch.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <csignal>
#include <cstring>
#include <mutex>
#include <semaphore>
#include <thread>

#include "app/common/interrupt.hpp"
#include "app/workbench/opened_folder.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

struct {
    std::mutex lock;
    std::vector<pid_t> processes;
} started;

}  // namespace

ProcessEnd run_self(const std::vector<std::string>& arguments, int folder, const std::string& input,
                    std::chrono::seconds patience) {
    static std::counting_semaphore<2> turn(2);
    struct Turn {
        Turn() { turn.acquire(); }
        ~Turn() { turn.release(); }
    } const mine;
    constexpr std::size_t kMost = 16'000'000;
    ChildProcess child(arguments, folder, input);
    const auto deadline = std::chrono::steady_clock::now() + patience;
    std::optional<ProcessEnd> end;
    while (!(end = child.end(kMost + 1))) {
        if (std::chrono::steady_clock::now() > deadline || interrupted()) child.stop(SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
    if (std::max(end->output.size(), end->messages.size()) > kMost)
        throw IoError("sidewall {}: its output is over {} bytes: use the command line", arguments.front(),
                      kMost);
    return *std::move(end);
}

void start_program(const std::vector<std::string>& words, int folder, int log) {
    const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
    const int says = log < 0 ? nothing.number() : log;
    const std::lock_guard guard(started.lock);
    const pid_t process = start_process(words, folder, {nothing.number(), says, says}, true);
    if (process < 0) throw IoError("cannot start {}: {}", words.front(), std::string(std::strerror(errno)));
    started.processes.push_back(process);
}

void forget_ended() {
    const std::lock_guard guard(started.lock);
    std::erase_if(started.processes, [](pid_t process) { return ::waitpid(process, nullptr, WNOHANG) != 0; });
}

}  // namespace sidewall::app
