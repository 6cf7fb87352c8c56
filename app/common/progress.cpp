#include "app/common/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "app/common/timing.hpp"

namespace sidewall::app {
namespace {

std::string clock_text(double seconds) {
    const auto s = static_cast<long>(seconds + 0.5);
    if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    return fmt::format("{}:{:02}", s / 60, s % 60);
}

}  // namespace

ProgressBar::ProgressBar(std::string title, double total, std::string unit, bool enabled)
    : title_(std::move(title)),
      unit_(std::move(unit)),
      total_(total),
      active_(enabled && isatty(STDERR_FILENO) != 0),
      start_(now()),
      last_draw_(0.0) {}

ProgressBar::~ProgressBar() {
    if (active_ && last_draw_ > 0.0) std::fputs("\r\033[K", stderr);
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
    const std::string text = fmt::format("\r\033[K{} [{:#<{}}{:.<{}}] {:.4g}/{:.4g} {} ETA {} {}", title_, "",
                                         filled, "", kWidth - filled, done, total_, unit_, eta, note);
    std::fputs(text.c_str(), stderr);  // the terminal may have been closed
    std::fflush(stderr);
}

}  // namespace sidewall::app
