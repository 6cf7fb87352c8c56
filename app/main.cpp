#include "app/commands/program.hpp"

namespace {

// Calls install_terminate_handler() before the static initialisers of the libraries. That of OpenVDB's
// logging starts threads, and throws if the system refuses them.
[[gnu::section(".preinit_array"),
  gnu::used]] void (*const before_libraries)() = sidewall::app::install_terminate_handler;

}  // namespace

int main(int argc, char** argv) {
    return sidewall::app::run_program(argc, argv);
}
