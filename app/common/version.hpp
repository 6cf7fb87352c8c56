#pragma once

namespace sidewall::app {

/// Of the program, e.g. "0.2.0".
const char* version();

}  // namespace sidewall::app
