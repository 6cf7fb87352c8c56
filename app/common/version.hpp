#pragma once

namespace sidewall::app {

/// The version of the program, e.g. "0.3.0".
const char* version();

/// The compiler, its instruction set and the libraries of this build, with versions, for `--version`.
const char* built_with();

}  // namespace sidewall::app
