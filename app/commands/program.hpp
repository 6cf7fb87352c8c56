#pragma once

namespace sidewall::app {

/// The whole program: reads the command line, runs the subcommand and reports errors.
/// \return the exit code
int run_program(int argc, char** argv);

/// Installs a terminate handler: if the system refuses memory or a thread inside a library function that must
/// not throw, the program ends with a message and exit code 4.
void install_terminate_handler();

}  // namespace sidewall::app
