#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// The parts of \p text between separators: one more than there are separators, empty ones included.
std::vector<std::string> split(std::string_view text, char separator);

}  // namespace sidewall::app
