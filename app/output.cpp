#include "app/output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>

#include "surface/error.hpp"
#include "surface/file.hpp"

namespace sidewall::app {
namespace {

volatile std::sig_atomic_t interrupt_count = 0;

extern "C" void on_interrupt(int signal) {
    interrupt_count = interrupt_count + 1;
    // The second Ctrl-C means it: fall back to the default action.
    std::signal(signal, SIG_DFL);
}

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string clock_text(double seconds) {
    const auto s = static_cast<long>(seconds + 0.5);
    if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    return fmt::format("{}:{:02}", s / 60, s % 60);
}

}  // namespace

void write_file(const std::filesystem::path& path, std::string_view text) {
    std::error_code failure;
    if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), failure);
    if (failure)
        throw IoError(fmt::format("{}: cannot make the folder: {}; choose another output folder",
                                  path.parent_path().string(), failure.message()));
    surface::write_whole_file(path, text);
}

void write_json(const std::string& path, const Json& json) {
    const std::string text = json.dump(2) + "\n";
    if (path == "-") {
        std::fwrite(text.data(), 1, text.size(), stdout);
        std::fflush(stdout);
    } else {
        write_file(path, text);
    }
}

bool interrupted() {
    return interrupt_count > 0;
}

void install_interrupt_handler() {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
}

ProgressBar::ProgressBar(std::string title, double total, std::string unit, bool enabled)
    : title_(std::move(title)),
      unit_(std::move(unit)),
      total_(total),
      active_(enabled && isatty(STDERR_FILENO) != 0),
      start_(now()),
      last_draw_(0.0) {}

ProgressBar::~ProgressBar() {
    if (active_ && last_draw_ > 0.0) fmt::print(stderr, "\r\033[K");
}

void ProgressBar::update(double done, std::string_view note) {
    const double time = now();
    if (!active_ || time - last_draw_ < 0.1) return;
    last_draw_ = time;
    const double fraction = total_ > 0.0 ? std::min(1.0, done / total_) : 0.0;
    constexpr int kWidth = 24;
    const int filled = static_cast<int>(fraction * kWidth);
    const std::string eta =
        fraction > 0.0 ? clock_text((time - start_) * (1.0 - fraction) / fraction) : "-:--";
    fmt::print(stderr, "\r\033[K{} [{:#<{}}{:.<{}}] {:.4g}/{:.4g} {} ETA {} {}", title_, "", filled, "",
               kWidth - filled, done, total_, unit_, eta, note);
    std::fflush(stderr);
}

}  // namespace sidewall::app
