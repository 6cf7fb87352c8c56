#pragma once
#include <fmt/format.h>

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

}  // namespace sidewall::app
