#include "app/common/console.hpp"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <ctime>
#include <initializer_list>
#include <string>

#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

#ifdef __GLIBC__
// A reader that has gone, as `tee` has after Ctrl-C, must not end the run: SIGPIPE is taken back.
extern "C" ssize_t write_or_lose(void*, const char* bytes, size_t count) {
    sigset_t pipe, before;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe, &before);
    for (size_t done = 0; done < count;) {
        const ssize_t written = write(STDERR_FILENO, bytes + done, count - done);
        if (written < 0 && errno == EINTR) continue;
        if (written < 0 && errno == EPIPE) {
            const timespec at_once{};
            sigtimedwait(&pipe, nullptr, &at_once);
        }
        if (written <= 0) break;
        done += static_cast<size_t>(written);
    }
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return static_cast<ssize_t>(count);
}
#endif

}  // namespace

void secure_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) == -1)  // open() takes the lowest free number, which is this one
            (void)open("/dev/null", stream == STDOUT_FILENO ? O_RDONLY : O_RDWR);
#ifdef __GLIBC__
    if (FILE* messages = fopencookie(nullptr, "w", {nullptr, write_or_lose, nullptr, nullptr})) {
        std::setvbuf(messages, nullptr, _IONBF, 0);
        stderr = messages;
    }
#endif
}

void print_warning(std::string_view line) {
    std::fputs((surface::printable(line) + '\n').c_str(), stderr);
}

void print_text(std::string_view text) {
    fmt::print("{}", surface::printable(text));
}

}  // namespace sidewall::app
