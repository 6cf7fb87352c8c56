#pragma once

namespace sidewall::app {

/// Lets the first Ctrl-C or SIGTERM set the flag that interrupted() reads; a second one ends the program.
/// SIGHUP, which a closed terminal sends, sets the flag, too, unless it is ignored, as under nohup.
void install_interrupt_handler();

/// Whether a signal has asked the program to stop.
bool interrupted();

}  // namespace sidewall::app
