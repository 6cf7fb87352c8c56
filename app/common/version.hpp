#pragma once

namespace sidewall::app {

/// The version of the program, e.g. "0.2.0".
const char* version();

}  // namespace sidewall::app
