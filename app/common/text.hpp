#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// The parts of \p text between separators: one more than there are separators, empty ones included.
std::vector<std::string> split(std::string_view text, char separator);

/// A field of a CSV row: in quotes if its text asks for them.
std::string csv_field(const std::string& text);

/// A word of a command line: in quotes if a shell would read it otherwise.
std::string shell_word(const std::string& text);

}  // namespace sidewall::app
