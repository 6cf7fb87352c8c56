#include "app/commands/program.hpp"

namespace {

// Runs before the libraries' own initialisers: that of logging in OpenVDB's starts threads, and throws if it
// may not.
[[gnu::section(".preinit_array"),
  gnu::used]] void (*const before_libraries)() = sidewall::app::end_by_message;

}  // namespace

int main(int argc, char** argv) {
    return sidewall::app::run_program(argc, argv);
}
