#pragma once
#include <nlohmann/json_fwd.hpp>

namespace sidewall::app {

/// JSON whose objects keep the order of insertion, so that files list entries in the order they were added.
using Json = nlohmann::ordered_json;

}  // namespace sidewall::app
