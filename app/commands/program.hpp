#pragma once

namespace sidewall::app {

/// The whole program: reads the command line, runs the subcommand, and says what went wrong.
/// \return the exit code
int run_program(int argc, char** argv);

}  // namespace sidewall::app
