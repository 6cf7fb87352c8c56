#include "app/common/interrupt.hpp"

#include <csignal>

namespace sidewall::app {
namespace {

volatile std::sig_atomic_t interrupt_count = 0;

extern "C" void on_interrupt(int signal) {
    interrupt_count = interrupt_count + 1;
    // By the default action a second signal ends the program. SIGHUP is ignored from here on, as a closed
    // terminal sends it more than once.
    std::signal(signal, signal == SIGHUP ? SIG_IGN : SIG_DFL);
}

}  // namespace

bool interrupted() {
    return interrupt_count > 0;
}

void install_interrupt_handler() {
    std::signal(SIGINT, on_interrupt);
    std::signal(SIGTERM, on_interrupt);
    // Under nohup SIGHUP stays ignored.
    if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

}  // namespace sidewall::app
