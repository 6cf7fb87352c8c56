#pragma once
#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>

namespace sidewall::surface {

/// All bytes of a file.
/// \throws FileError if it is missing, a folder, a pipe or a device, or unreadable.
std::string read_whole_file(const std::filesystem::path& path);

/// A path's extension in lower case, with its dot: ".vtp" of "Fin.VTP".
std::string lower_extension(const std::filesystem::path& path);

/// Reads a text that is one number and nothing else; false for any other text, such as one with a leading +.
/// \param base  of the digits of a whole number; default ten.
template <class Number, class... Base>
bool read_number(std::string_view text, Number& value, Base... base) {
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
    return failure == std::errc{} && end == text.data() + text.size();
}

/// Makes a text safe to print on a terminal: UTF-8 characters, line breaks and tabs stay, every other byte
/// and control character becomes `\xNN`. For messages that may quote a damaged file.
/// \param one_line  whether line breaks and tabs also become `\x0a` and `\x09`, as suits a name.
std::string printable(std::string_view text, bool one_line = false);

}  // namespace sidewall::surface
