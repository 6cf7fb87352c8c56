// Runs the program on a disk that fills up, or kills it, at a chosen operation on a file that it writes.
// SIDEWALL_FAULT="full N": from the N-th operation on, all but removals fail for want of space; "kill N": the
// program is killed before the N-th operation. copies.cpp and system_calls.cpp implement other faults.
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <string_view>

#include "app/commands/program.hpp"
#include "surface/files/output_file.hpp"
#include "tests/faults/copies.hpp"

namespace {

struct Fault {
    std::string kind;
    int operation = 0;
};

const Fault& fault() {
    static const Fault asked = [] {
        Fault f;
        if (const char* text = std::getenv("SIDEWALL_FAULT"))
            std::istringstream(text) >> f.kind >> f.operation;
        return f;
    }();
    return asked;
}

int strike(const char* operation, const std::filesystem::path&) {
    static std::atomic<int> count = 0;
    if (++count < fault().operation) return 0;
    if (fault().kind == "kill") std::raise(SIGKILL);
    return fault().kind == "full" && std::string_view(operation) != "remove" ? ENOSPC : 0;
}

[[maybe_unused]] const bool installed = [] {
    sidewall::surface::file_operation_hook = strike;
    return true;
}();

}  // namespace

int main(int argc, char** argv) {
    sidewall::faults::begin_survey();
    return sidewall::app::run_program(argc, argv);
}
