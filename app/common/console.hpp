#pragma once
#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace sidewall::app {

/// Secures the standard streams; to be called before any file is opened. A closed stream is opened on
/// /dev/null, as a file of results would otherwise get its number and the messages; writing to a closed
/// standard output still fails. Messages that standard error cannot take, as on a full disk, are dropped.
void secure_standard_streams();

/// Writes a line to standard error. The command line prints the warnings of runs with it.
void print_warning(std::string_view line);

/// Prints to standard output. Control characters, which names that users give may hold, are escaped.
void print_text(std::string_view text);
template <class... Args>
void print_plain(fmt::format_string<Args...> format, Args&&... args) {
    print_text(fmt::format(format, std::forward<Args>(args)...));
}

/// Decides when lines of progress are due without a terminal: every minute, if asked also at every tenth.
class LineTimer {
  public:
    /// \param fraction  share of the work that is done at the start. \p tenths: lines at every tenth, too.
    LineTimer(double fraction, bool tenths);
    /// Whether a line is due; if so, it counts as printed. \p seconds since the start.
    bool due(double fraction, double seconds);

  private:
    bool tenths_;
    int last_tenth_;
    double last_seconds_ = 0.0;
};

/// Options of a ProgressBar.
struct ProgressOptions {
    double from = 0.0;    ///< amount done when the bar begins, as in a resumed run
    bool tenths = false;  ///< without a terminal, a line at every tenth, too
};

/// Progress on standard error: one line that is redrawn on a terminal; else a line a minute.
class ProgressBar {
  public:
    /// \p unit names what is counted, e.g. "s" of process time. \p enabled false silences it altogether.
    ProgressBar(const std::string& title, double total, std::string unit, bool enabled = true,
                ProgressOptions options = {});
    ~ProgressBar();
    ProgressBar(const ProgressBar&) = delete;
    ProgressBar& operator=(const ProgressBar&) = delete;
    /// Redraws at most ten times a second: done of total, ETA, and \p note.
    void update(double done, std::string_view note = {});
    /// Prints \p text at once, on a separate line.
    void line(std::string_view text);

  private:
    double fraction(double done) const;

    std::string title_, unit_;
    double total_, from_;
    bool enabled_, terminal_;
    double start_, last_draw_;
    LineTimer timer_;
};

}  // namespace sidewall::app
