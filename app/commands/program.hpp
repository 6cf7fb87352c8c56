#pragma once

namespace sidewall::app {

/// The whole program: reads the command line, runs the subcommand, and says what went wrong.
/// \return the exit code
int run_program(int argc, char** argv);

/// From now on, memory or a thread that the system refuses where a library may not throw ends the program by a message and
/// exit code 4.
void end_by_message();

}  // namespace sidewall::app
