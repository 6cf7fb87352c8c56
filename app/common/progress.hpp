#pragma once
#include <string>
#include <string_view>

namespace sidewall::app {

/// Progress on standard error: one line, redrawn on a terminal, silent when piped.
class ProgressBar {
  public:
    /// \p unit names what is counted, e.g. "s" of process time. \p enabled false silences it on a terminal
    /// too.
    ProgressBar(std::string title, double total, std::string unit, bool enabled = true);
    ~ProgressBar();
    /// Redraws at most ten times a second: done of total, ETA, and \p note.
    void update(double done, std::string_view note = {});

  private:
    std::string title_, unit_;
    double total_;
    bool active_;
    double start_, last_draw_;
};

}  // namespace sidewall::app
