#pragma once
#include <string>
#include <string_view>

namespace sidewall::surface {

/// Text that a terminal can be given: characters of UTF-8, line breaks and tabs stay, every other byte and
/// control character becomes `\xNN`. For texts that may quote a damaged file.
std::string printable(std::string_view text);

}  // namespace sidewall::surface
