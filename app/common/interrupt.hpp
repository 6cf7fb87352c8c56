#pragma once

namespace sidewall::app {

/// From now on Ctrl-C and SIGTERM are noted, once; before, and the second time, they end the program. So is
/// SIGHUP, of a closed terminal, unless it is ignored, as nohup does.
void install_interrupt_handler();

/// One was noted.
bool interrupted();

}  // namespace sidewall::app
