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

/// Whether a text is a number and nothing else, which is read. A + before it makes it none.
/// \param base  of a whole number's digits; default ten.
template <class Number, class... Base>
bool read_number(std::string_view text, Number& value, Base... base) {
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
    return failure == std::errc{} && end == text.data() + text.size();
}

/// Text that a terminal can be given: characters of UTF-8, line breaks and tabs stay, every other byte and
/// control character becomes `\xNN`. For texts that may quote a damaged file.
/// \param one_line  line breaks and tabs become `\x0a` and `\x09`, too, as suits a name.
std::string printable(std::string_view text, bool one_line = false);

}  // namespace sidewall::surface
