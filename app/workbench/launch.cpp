#include "app/workbench/launch.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <array>
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

// Starts a process with these files as standard input, output and error, and no other open file.
pid_t spawn(const std::vector<std::string>& words, int folder, const std::array<int, 3>& files, short flags) {
    std::vector<char*> pointers;
    std::vector<std::string> texts = words;
    pointers.reserve(texts.size() + 1);
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
    // SIGINT and SIGTERM stop the process, even if this thread (one of a library's, say) blocks signals.
    sigset_t none, stopping;
    ::sigemptyset(&none);
    ::sigemptyset(&stopping);
    for (const int signal : {SIGINT, SIGTERM}) ::sigaddset(&stopping, signal);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setsigdefault(&attributes, &stopping);
    ::posix_spawnattr_setflags(&attributes,
                               static_cast<short>(flags | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF));
    const int no_folder = ::posix_spawn_file_actions_addfchdir_np(&actions, folder);
    for (int k = 0; k < 3; ++k)
        ::posix_spawn_file_actions_adddup2(&actions, files[static_cast<std::size_t>(k)], k);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, 3);
    pid_t process = 0;
    const int failure =
        no_folder != 0 ? no_folder
        : words.front() == "sidewall"
            ? ::posix_spawn(&process, "/proc/self/exe", &actions, &attributes, pointers.data(), environ)
            : ::posix_spawnp(&process, words.front().c_str(), &actions, &attributes, pointers.data(),
                             environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
    if (failure != 0)
        throw IoError("cannot start {}: {}", words.front(), std::string(std::strerror(failure)));
    return process;
}

Descriptor memory_file() {
    Descriptor file(::memfd_create("sidewall", MFD_CLOEXEC));
    if (file.number() < 0) throw IoError("no file in memory: {}", std::string(std::strerror(errno)));
    return file;
}

std::string text_in(const Descriptor& file, const std::string& command) {
    constexpr std::size_t kMost = 16'000'000;
    const off_t size = ::lseek(file.number(), 0, SEEK_END);
    if (size > static_cast<off_t>(kMost))
        throw IoError("sidewall {}: its output has {} bytes, over {}: use the command line", command, size,
                      kMost);
    return text_of(file, kMost);
}

// Waits for the end of a process, kills it after \p patience or an interrupt, and returns its wait status.
int wait_for(pid_t process, std::chrono::seconds patience) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    int status = 0;
    while (::waitpid(process, &status, WNOHANG) == 0) {
        if (std::chrono::steady_clock::now() > deadline || interrupted()) ::kill(process, SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
    return status;
}

}  // namespace

ProcessOutput run_self(const std::vector<std::string>& arguments, int folder, const std::string& input,
                       std::chrono::seconds patience) {
    static std::counting_semaphore<2> turn(2);
    struct Turn {
        Turn() { turn.acquire(); }
        ~Turn() { turn.release(); }
    } const mine;
    const Descriptor in = memory_file(), out = memory_file(), messages = memory_file();
    if (::write(in.number(), input.data(), input.size()) != static_cast<ssize_t>(input.size()) ||
        ::lseek(in.number(), 0, SEEK_SET) != 0)
        throw IoError("no memory for a process's input: {}", std::string(std::strerror(errno)));
    std::vector<std::string> words{"sidewall"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const int status =
        wait_for(spawn(words, folder, {in.number(), out.number(), messages.number()}, POSIX_SPAWN_SETPGROUP),
                 patience);
    constexpr int kSignalled = 128;
    return {WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status),
            text_in(out, arguments.front()), text_in(messages, arguments.front())};
}

void start_program(const std::vector<std::string>& words, int folder, int log) {
    const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
    const int says = log < 0 ? nothing.number() : log;
    const std::lock_guard guard(started.lock);
    started.processes.push_back(spawn(words, folder, {nothing.number(), says, says}, POSIX_SPAWN_SETSID));
}

void forget_ended() {
    const std::lock_guard guard(started.lock);
    std::erase_if(started.processes, [](pid_t process) { return ::waitpid(process, nullptr, WNOHANG) != 0; });
}

}  // namespace sidewall::app
