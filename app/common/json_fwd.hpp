#pragma once
#include <nlohmann/json_fwd.hpp>

namespace sidewall::app {

/// Insertion order is kept, so that reports read in the order they were written.
using Json = nlohmann::ordered_json;

}  // namespace sidewall::app
