#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// The parts of \p text between separators: one more than there are separators, empty ones included.
std::vector<std::string> split(std::string_view text, char separator);

/// The text without the blanks, tabs and carriage returns at its ends.
std::string_view trimmed(std::string_view text);

/// The number that is the whole of the text; nothing if it is none or not finite. A + before it makes it none.
std::optional<double> finite_number(std::string_view text);

/// A field of a CSV row: in quotes if its text asks for them.
std::string csv_field(const std::string& text);

/// The rows of a CSV text (RFC 4180) as fields without their quotes; after a last line break comes one more, of an empty field.
std::vector<std::vector<std::string>> csv_rows(std::string_view text);

/// A word of a command line: in quotes if a shell would read it otherwise.
std::string shell_word(const std::string& text);

/// 64 bits of FNV-1a as hexadecimal digits, which differ for different texts.
std::string digest(std::string_view text);

}  // namespace sidewall::app
