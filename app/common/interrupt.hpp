#pragma once

namespace sidewall::app {

/// Lets the first Ctrl-C or SIGTERM set the flag that interrupted() reads; a second one ends the program. SIGHUP, of a
/// closed terminal, counts as well, unless it is ignored, as nohup does.
void install_interrupt_handler();

/// Whether a signal has asked the program to stop.
bool interrupted();

}  // namespace sidewall::app
