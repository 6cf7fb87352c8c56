#include <fcntl.h>
#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <new>
#include <system_error>

#include "app/commands/commands.hpp"
#include "app/common/version.hpp"
#include "surface/error.hpp"
#include "surface/printable.hpp"

namespace {

using namespace sidewall;

// The program's exit code.
int run(int argc, char** argv) {
    CLI::App program{"Sidewall: etch and deposition on a virtual wafer"};
    program.name("sidewall");
    program.set_version_flag("--version", app::version());
    program.require_subcommand(1);
    app::add_run_command(program);
    app::add_check_command(program);
    app::add_models_command(program);
    app::add_compare_command(program);
    app::add_study_command(program);
    app::add_simplify_command(program);
    app::add_flux_command(program);
    app::add_inspect_command(program);
    app::add_render_command(program);
    for (CLI::App* command : program.get_subcommands({})) app::add_threads_option(*command);
    app::add_completion_command(program);
    app::add_man_command(program);

    try {
        program.parse(argc, argv);
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            throw IoError("standard output: cannot write all of it; check space on the device it goes to");
        return 0;
    } catch (const CLI::ParseError& error) {
        // CLI11 throws for --help and --version, too; only those end well.
        return program.exit(error) == 0 ? 0 : 2;
    } catch (const Error& error) {
        // The terminal may have been closed, which is no other error.
        std::fputs(fmt::format("sidewall: {}\n", surface::printable(error.what())).c_str(), stderr);
        return error.exit_code();
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "sidewall: out of memory: use a larger grid_spacing or a smaller extent\n");
        return 4;
    } catch (const std::system_error& error) {  // of the C library's streams, by fmt
        fmt::print(stderr, "sidewall: {}; check space and permissions\n", error.what());
        return 5;
    } catch (const std::exception& error) {
        fmt::print(stderr, "sidewall: internal error: {}\n", error.what());
        return 4;
    }
}

// A file that is written must not get the number of a standard stream that is closed, or messages would go
// into it. Writing to such a standard output stays an error; nobody reads such a standard error.
void occupy_standard_streams() {
    constexpr int kModes[] = {O_RDONLY, O_RDONLY, O_WRONLY};
    for (int stream = 0; stream < 3; ++stream)
        if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", kModes[stream]);
}

}  // namespace

int main(int argc, char** argv) {
    occupy_standard_streams();
    std::signal(SIGXFSZ, SIG_IGN);  // a file over the user's limit is a failed write
    try {
        return run(argc, argv);
    } catch (...) {  // not even a message got through
        return 4;
    }
}
