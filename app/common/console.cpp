#include "app/common/console.hpp"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "app/common/timing.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Writes to standard error; failures are ignored. If its reader is gone, as `tee` is after Ctrl-C, the
// SIGPIPE of the write is discarded, so that it does not end the run.
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

std::string clock_text(double seconds) {
    const auto s = static_cast<long>(seconds + 0.5);
    if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    return fmt::format("{}:{:02}", s / 60, s % 60);
}

int tenth_of(double fraction) {
    return static_cast<int>(10.0 * fraction + 1e-9);
}

}  // namespace

void secure_standard_streams() {
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (fcntl(stream, F_GETFD) == -1)  // open() takes the lowest free number, which is this one
            (void)open("/dev/null", stream == STDOUT_FILENO ? O_RDONLY : O_RDWR);
    if (FILE* messages = fopencookie(nullptr, "w", {nullptr, write_or_lose, nullptr, nullptr})) {
        std::setvbuf(messages, nullptr, _IONBF, 0);
        stderr = messages;
    }
}

void print_warning(std::string_view line) {
    std::fputs((surface::printable(line) + '\n').c_str(), stderr);
}

void print_text(std::string_view text) {
    fmt::print("{}", surface::printable(text));
}

LineTimer::LineTimer(double fraction, bool tenths) : tenths_(tenths), last_tenth_(tenth_of(fraction)) {}

bool LineTimer::due(double fraction, double seconds) {
    const int tenth = tenth_of(fraction);
    const bool is = (tenths_ && tenth > last_tenth_) || seconds - last_seconds_ >= 60.0;
    last_tenth_ = std::max(last_tenth_, tenth);
    if (is) last_seconds_ = seconds;
    return is;
}

ProgressBar::ProgressBar(const std::string& title, double total, std::string unit, bool enabled,
                         ProgressOptions options)
    : title_(surface::printable(title, true)),
      unit_(std::move(unit)),
      total_(total),
      from_(options.from),
      enabled_(enabled),
      terminal_(isatty(STDERR_FILENO) != 0),
      start_(now()),
      last_draw_(0.0),
      timer_(fraction(options.from), options.tenths) {}

ProgressBar::~ProgressBar() {
    if (enabled_ && terminal_ && last_draw_ > 0.0) std::fputs("\r\033[K", stderr);
}

double ProgressBar::fraction(double done) const {
    return total_ > 0.0 ? std::clamp(done / total_, 0.0, 1.0) : 0.0;
}

void ProgressBar::update(double done, std::string_view note) {
    if (!enabled_) return;
    const double time = now(), part = fraction(done), began = fraction(from_);
    if (terminal_ ? time - last_draw_ < 0.1 : !timer_.due(part, time - start_)) return;
    last_draw_ = time;
    const std::string eta =
        part > began ? clock_text((time - start_) * (1.0 - part) / (part - began)) : "-:--";
    const std::string where =
        fmt::format("{:.4g}/{:.4g} {} ETA {} {}", done, total_, unit_, eta, surface::printable(note, true));
    std::string text;
    if (terminal_) {
        constexpr int kWidth = 24;
        const int filled = static_cast<int>(part * kWidth);
        text = fmt::format("\r\033[K{} [{:#<{}}{:.<{}}] {}", title_, "", filled, "", kWidth - filled, where);
    } else {
        text = fmt::format("{}: {:.0f} %, {}\n", title_, std::floor(100.0 * part + 1e-9), where);
    }
    std::fputs(text.c_str(), stderr);
    std::fflush(stderr);
}

void ProgressBar::line(std::string_view text) {
    if (!enabled_) return;
    const std::string whole =
        fmt::format("{}{}: {}\n", terminal_ ? "\r\033[K" : "", title_, surface::printable(text));
    std::fputs(whole.c_str(), stderr);
    std::fflush(stderr);
}

}  // namespace sidewall::app
