#include "app/commands/program.hpp"

int main(int argc, char** argv) {
    return sidewall::app::run_program(argc, argv);
}
