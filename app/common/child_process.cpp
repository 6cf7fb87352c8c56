#include "app/common/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/auxv.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Between fork and exec: only calls that are safe while other threads hold locks.
[[noreturn]] void become(const std::vector<char*>& words, int output, pid_t parent) {
    constexpr int kNoProgram = 127;
    ::setpgid(0, 0);
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(kNoProgram);  // it ended before
    ::dup2(::open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
    ::dup2(output, STDOUT_FILENO);
    ::dup2(output, STDERR_FILENO);
    ::execv("/proc/self/exe", words.data());
    // Where /proc is not mounted. The kernel gives the address of the program's name as a number.
    const auto* name =
        reinterpret_cast<const char*>(::getauxval(AT_EXECFN));  // NOLINT(performance-no-int-to-ptr)
    ::execv(name, words.data());
    ::_exit(kNoProgram);
}

std::string text_of(int file) {
    constexpr std::size_t kMost = 1 << 16;  // of its end
    const off_t size = ::lseek(file, 0, SEEK_END);
    if (size <= 0) return {};
    std::string text(std::min<std::size_t>(static_cast<std::size_t>(size), kMost), '\0');
    const ssize_t read = ::pread(file, text.data(), text.size(), size - static_cast<off_t>(text.size()));
    text.resize(read > 0 ? static_cast<std::size_t>(read) : 0);
    return text;
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& arguments) {
    std::vector<std::string> texts{"sidewall"};
    texts.insert(texts.end(), arguments.begin(), arguments.end());
    std::vector<char*> words;
    words.reserve(texts.size() + 1);
    for (std::string& text : texts) words.push_back(text.data());
    words.push_back(nullptr);
    output_ = ::memfd_create("sidewall", MFD_CLOEXEC);
    const pid_t parent = ::getpid();
    process_ = output_ < 0 ? -1 : ::fork();
    if (process_ == 0) become(words, output_, parent);
    if (process_ > 0) return;
    const std::string reason = std::strerror(errno);
    if (output_ >= 0) ::close(output_);
    throw NumericsError(fmt::format("cannot start a process: {}; use fewer --jobs", reason));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : process_(std::exchange(other.process_, -1)), output_(std::exchange(other.output_, -1)) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
    std::swap(process_, other.process_);
    std::swap(output_, other.output_);
    return *this;
}

ChildProcess::~ChildProcess() {
    if (process_ > 0) {
        ask_to_stop();
        while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
        }
    }
    if (output_ >= 0) ::close(output_);
}

std::optional<ProcessEnd> ChildProcess::end() {
    int status = 0;
    if (process_ <= 0 || ::waitpid(process_, &status, WNOHANG) != process_) return std::nullopt;
    process_ = -1;
    constexpr int kSignalled = 128;
    return ProcessEnd{WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status),
                      text_of(output_)};
}

void ChildProcess::ask_to_stop() const {
    if (process_ > 0) ::kill(process_, SIGTERM);
}

}  // namespace sidewall::app
