#pragma once
#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace sidewall::app {

/// Secures the standard streams before anything is opened. The numbers of closed ones are taken, so that no file of
/// results gets them and messages with it; writing to a closed standard output still fails. Messages on standard
/// error that cannot be written, as on a full disk, are lost without a failure.
void secure_standard_streams();

/// Writes a line on standard error: where the command line sends the warnings of a run.
void print_warning(std::string_view line);

/// Prints text to standard output as fmt::print does, but escapes what a terminal would obey: users' names may hold that.
void print_text(std::string_view text);
template <class... Args>
void print_plain(fmt::format_string<Args...> format, Args&&... args) {
    print_text(fmt::format(format, std::forward<Args>(args)...));
}

/// A timer for lines of progress where there is no terminal: one is due every minute, and at every tenth of the work.
class LineTimer {
  public:
    /// \param fraction  that is done at the start, where nothing is due. \p tenths false leaves the minutes alone.
    LineTimer(double fraction, bool tenths);
    /// Whether a line is due now; if so, one has been said. \p seconds since the start.
    bool due(double fraction, double seconds);

  private:
    bool tenths_;
    int last_tenth_;
    double last_seconds_ = 0.0;
};

/// Options of a ProgressBar.
struct ProgressOptions {
    double from = 0.0;    ///< what is done already when it begins, as in a resumed run
    bool tenths = false;  ///< where there is no terminal, a line at every tenth too
};

/// Progress on standard error: one line, redrawn on a terminal; else a line a minute.
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
    /// Says something of its own line, at once.
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
