#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace sidewall::app {

/// Insertion order is kept, so that reports read in the order they were written.
using Json = nlohmann::ordered_json;

/// Writes \p text to \p path through a temporary file that is renamed: a reader never sees half a file.
/// Missing folders are made.
/// \throws IoError naming the path and the system's reason.
void write_file(const std::filesystem::path& path, std::string_view text);

/// Writes indented JSON to a file, or to standard output if \p path is "-". Non-finite numbers become null.
void write_json(const std::string& path, const Json& json);

/// From now on Ctrl-C and SIGTERM are noted, once; before, and the second time, they end the program.
void install_interrupt_handler();

/// One was noted.
bool interrupted();

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
