#pragma once
#include <string>

#include "app/common/json_fwd.hpp"

namespace sidewall::app {

/// The JSON of a text that anybody may have written. It is discarded if it is no JSON, is nested deeper than 64 levels, or has more
/// than \p most keys and values, ends of lists and objects among them: the time of an object grows with the square of its keys.
Json parse_foreign_json(const std::string& text, std::size_t most);

}  // namespace sidewall::app
