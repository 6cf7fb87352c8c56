#include "app/common/processes.hpp"

#include <fmt/format.h>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/auxv.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <thread>

#include "app/common/interrupt.hpp"
#include "app/common/text.hpp"
#include "app/common/timing.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kModule = "libsidewall_mpi.so";
constexpr int kInterrupted = 130;

// The functions of app/mpi/mpi.cpp.
struct Mpi {
    void (*join)(int*, int*) = nullptr;
    void (*sum)(std::uint64_t*, std::size_t) = nullptr;
    void (*abort)(int) = nullptr;
    void (*leave)() = nullptr;
};

std::optional<Mpi> mpi;
std::atomic<bool> stop_agreed = false;
double in_sums = 0.0;
int messages = STDERR_FILENO;  // descriptor for this rank's error

std::uint32_t environment_number(const char* name, std::uint32_t otherwise) {
    const char* text = std::getenv(name);
    const auto value = text != nullptr ? finite_number(text) : std::nullopt;
    return value && *value >= 0.0 && *value < 1e9 ? static_cast<std::uint32_t>(*value) : otherwise;
}

Ranks read_ranks() {
    const std::uint32_t count = environment_number("OMPI_COMM_WORLD_SIZE", 1);
    if (count <= 1) return {};
    return {environment_number("OMPI_COMM_WORLD_RANK", 0), count,
            std::max<std::uint32_t>(1, environment_number("OMPI_COMM_WORLD_LOCAL_SIZE", 1))};
}

template <class Function>
void load(void* module, const char* name, Function& function) {
    function = reinterpret_cast<Function>(::dlsym(module, name));
    if (function == nullptr) throw RecipeError("{} does not fit this program: install both anew", kModule);
}

Mpi load_mpi() {
    void* module = ::dlopen(kModule, RTLD_NOW | RTLD_GLOBAL);
    if (module == nullptr)
        throw RecipeError(
            "mpirun has started {} processes, and this installation cannot join them ({}): build it where "
            "libopenmpi-dev is installed, or start one process",
            ranks().count, ::dlerror());
    Mpi loaded;
    load(module, "sidewall_mpi_join", loaded.join);
    load(module, "sidewall_mpi_sum", loaded.sum);
    load(module, "sidewall_mpi_abort", loaded.abort);
    load(module, "sidewall_mpi_leave", loaded.leave);
    return loaded;
}

void sum(std::span<std::uint64_t> values) {
    const double start = now();
    mpi->sum(values.data(), values.size());
    std::uint64_t asked = interrupted() ? 1 : 0;
    mpi->sum(&asked, 1);
    if (asked > 0) stop_agreed = true;
    in_sums += now() - start;
}

std::unique_ptr<tbb::global_control> limit;

// Turns the forked child into another program, by calls that are safe while other threads hold locks.
[[noreturn]] void become(char* const* words, bool self, int folder, const std::array<int, 3>& files) {
    constexpr int kNoProgram = 127;
    // SIGINT and SIGTERM stop it, even if this thread (one of a library's, say) blocks or ignores them.
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    for (const int signal : {SIGINT, SIGTERM}) ::signal(signal, SIG_DFL);
    if (folder >= 0 && ::fchdir(folder) != 0) ::_exit(kNoProgram);
    for (int k = 0; k < 3; ++k) ::dup2(files[static_cast<std::size_t>(k)], k);
    ::closefrom(3);
    if (!self) ::execvp(words[0], words);
    if (!self) ::_exit(kNoProgram);
    ::execv("/proc/self/exe", words);
    // Reached where /proc is not mounted. The kernel gives the address of the program's name as a number.
    const auto* name =
        reinterpret_cast<const char*>(::getauxval(AT_EXECFN));  // NOLINT(performance-no-int-to-ptr)
    ::execv(name, words);
    ::_exit(kNoProgram);
}

std::string text_of(int file, std::size_t most) {
    const off_t size = ::lseek(file, 0, SEEK_END);
    if (size <= 0) return {};
    std::string text(std::min<std::size_t>(static_cast<std::size_t>(size), most), '\0');
    const ssize_t read = ::pread(file, text.data(), text.size(), size - static_cast<off_t>(text.size()));
    text.resize(read > 0 ? static_cast<std::size_t>(read) : 0);
    return text;
}

}  // namespace

const Ranks& ranks() {
    static const Ranks ranks = read_ranks();
    return ranks;
}

void begin_rank() {
    if (ranks().count == 1) return;
    for (const char* name : {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE"})
        ::unsetenv(name);
    const int cores = static_cast<int>(std::thread::hardware_concurrency() / ranks().on_this_machine);
    limit_threads(std::clamp(cores, 1, thread_count()));
    if (ranks().rank == 0) return;
    messages = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
}

flux::Shares join_ranks() {
    if (ranks().count == 1) return {};
    const Mpi loaded = load_mpi();
    int rank = 0, count = 1;
    loaded.join(&rank, &count);
    mpi = loaded;
    return {static_cast<std::uint32_t>(rank), static_cast<std::uint32_t>(count), sum};
}

bool any_rank_interrupted() {
    return stop_agreed;
}

double seconds_in_sums() {
    return in_sums;
}

void report_failure(const char* text, int exit_code) {
    if (ranks().rank == 0) {
        std::fputs(text, stderr);
        return;
    }
    const timespec patience{.tv_sec = 2, .tv_nsec = 0};
    if (exit_code == kInterrupted || ::nanosleep(&patience, nullptr) != 0) return;  // mpirun ends this rank
    const std::string whole = fmt::format("rank {}: {}", ranks().rank, text);
    if (::write(messages, whole.data(), whole.size()) < 0) return;
}

int end_rank(int exit_code) {
    if (!mpi) return exit_code;
    std::fflush(stdout);
    if (exit_code != 0 && exit_code != kInterrupted) mpi->abort(exit_code);
    mpi->leave();
    return exit_code;
}

int thread_count() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void limit_threads(int count) {
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(count));
}

pid_t start_process(std::vector<std::string> words, int folder, const std::array<int, 3>& files,
                    bool outlive) {
    std::vector<char*> pointers;
    pointers.reserve(words.size() + 1);
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const bool self = words.front() == "sidewall";
    const pid_t parent = ::getpid(), process = ::fork();
    if (process != 0) return process;
    if (outlive) {
        ::setsid();
    } else {
        ::setpgid(0, 0);
        ::prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (::getppid() != parent) ::_exit(1);  // the parent has ended already
    }
    become(pointers.data(), self, folder, files);
}

ChildProcess::ChildProcess(std::vector<std::string> arguments, int folder, const std::string& input) {
    arguments.insert(arguments.begin(), "sidewall");
    for (int& file : files_) file = ::memfd_create("sidewall", MFD_CLOEXEC);
    if (files_[2] >= 0 && ::write(files_[0], input.data(), input.size()) == std::ssize(input) &&
        ::lseek(files_[0], 0, SEEK_SET) == 0)
        process_ = start_process(std::move(arguments), folder, files_, false);
    if (process_ > 0) return;
    const std::string reason = std::strerror(errno);
    for (const int file : files_) ::close(file);
    throw NumericsError("cannot start a process: {}; let fewer run at a time", reason);
}

ChildProcess::~ChildProcess() {
    stop(SIGTERM);
    while (process_ > 0 && ::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
    for (const int file : files_) ::close(file);
}

std::optional<ProcessEnd> ChildProcess::end(std::size_t most) {
    int status = 0;
    if (process_ <= 0) return std::nullopt;
    const pid_t ended = ::waitpid(process_, &status, WNOHANG);
    if (ended == 0 || (ended < 0 && errno != ECHILD)) return std::nullopt;
    process_ = -1;  // and where SIGCHLD is ignored, its status is lost: 0
    constexpr int kSignalled = 128;
    return ProcessEnd{WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status),
                      text_of(files_[1], most), text_of(files_[2], most)};
}

void ChildProcess::stop(int signal) const {
    if (process_ > 0) ::kill(process_, signal);
}

}  // namespace sidewall::app
