#pragma once
#include <string_view>

namespace sidewall::app {

/// The strokes of a character: points "xy" on a grid of x 0..4 and y 0..8, joined to lines; a space begins a
/// new line, a point alone is a dot. Capitals stand from y = 2 to 8, small letters reach 6, descenders 0.
std::string_view glyph_strokes(char32_t character);

}  // namespace sidewall::app
