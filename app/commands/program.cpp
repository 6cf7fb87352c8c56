#include "app/commands/program.hpp"

#include <fmt/format.h>

#include <malloc.h>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/free_memory.hpp"
#include "app/common/processes.hpp"
#include "app/common/version.hpp"
#include "app/schema/keys.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {

// Each subcommand lives in a file of its name, which adds it to the program.
void add_run_command(CLI::App& program);
void add_check_command(CLI::App& program);
void add_models_command(CLI::App& program);
void add_compare_command(CLI::App& program);
void add_study_command(CLI::App& program);
void add_validate_command(CLI::App& program);
void add_sweep_command(CLI::App& program);
void add_fit_command(CLI::App& program);
void add_simplify_command(CLI::App& program);
void add_flux_command(CLI::App& program);
void add_inspect_command(CLI::App& program);
void add_render_command(CLI::App& program);
void add_report_command(CLI::App& program);
void add_export_command(CLI::App& program);
void add_open_command(CLI::App& program);
void add_completion_command(CLI::App& program);
void add_man_command(CLI::App& program);

namespace {

constexpr const char* kNoMemory =
    "sidewall: out of memory: use a larger grid_spacing, a smaller extent or mesh or fewer --threads, or "
    "raise the limit (ulimit -v)\n";
constexpr const char* kNoThread =
    "sidewall: cannot start a thread: use fewer --threads, or raise the limit of threads (ulimit -u, or pids.max of the "
    "control group; some more than --threads are needed) or of memory (ulimit -v)\n";

// The message for an error by which a library reports refused memory or a refused thread; null for others.
const char* message_of_limit(const std::exception& error) {
    const auto* system = dynamic_cast<const std::system_error*>(&error);
    const std::string_view text = error.what();
    if ((system != nullptr && system->code() == std::errc::resource_unavailable_try_again) ||
        text.find("pthread_create") != text.npos)
        return kNoThread;
    const bool memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
                        (system != nullptr && system->code() == std::errc::not_enough_memory) ||
                        text.find("allocation failed") != text.npos;
    return memory ? kNoMemory : nullptr;
}

// Terminate handler: reports memory or a thread that was refused inside a library function that must not
// throw (JSON's destructors, folder iterators). The next run removes half-written files.
[[noreturn]] void end_in_terminate() {
    const char* message = nullptr;
    try {
        if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
    } catch (const std::exception& error) {
        message = message_of_limit(error);
    } catch (...) {
    }
    if (message == nullptr) std::abort();
    report_failure(message, 4);
    std::_Exit(4);
}

// Reports the error that ends the program.
// \returns \p exit_code.
int fail(const char* text, int exit_code) {
    report_failure(text, exit_code);
    return exit_code;
}

std::string usage_error(const CLI::App* command, const CLI::Error& error) {
    return "sidewall: " + surface::printable(CLI::FailureMessage::simple(command, error));
}

// The error for a first word that is no subcommand.
std::optional<std::string> unknown_command(CLI::App& program, const std::string& word) {
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) names.push_back(command->get_name());
    if (word.starts_with('-') || std::find(names.begin(), names.end(), word) != names.end()) return {};
    return fmt::format("sidewall: there is no subcommand {}{}\n", surface::printable(word),
                       did_you_mean("; ", word, names, "; see sidewall --help"));
}

// Refuses commands that are not shared by the ranks of mpirun: each rank would do all of the work.
void require_shared_command(int argc, char** argv) {
    const std::string_view name = argc > 1 ? argv[1] : "";
    if (ranks().count == 1 || name.starts_with('-') || name == "run" || name == "sweep" || name == "fit")
        return;
    throw RecipeError(
        "{}: is work for one process: start it without mpirun, which shares run, sweep and fit; in a script that mpirun "
        "has started, unset OMPI_COMM_WORLD_SIZE for it",
        surface::printable(std::string(name)));
}

int run(int argc, char** argv) {
    CLI::App program{"Sidewall: etch and deposition on a virtual wafer"};
    program.name("sidewall");
    program.set_version_flag("--version", fmt::format("{}\n{}", version(), built_with()));
    program.require_subcommand(1);
    program.failure_message(usage_error);
    for (const auto add :
         {add_run_command, add_check_command, add_models_command, add_compare_command, add_study_command,
          add_validate_command, add_sweep_command, add_fit_command, add_simplify_command, add_flux_command,
          add_inspect_command, add_render_command, add_report_command, add_export_command, add_open_command})
        add(program);
    for (CLI::App* command : program.get_subcommands({})) add_threads_option(*command);
    add_completion_command(program);
    add_man_command(program);

    try {
        constexpr double kToBegin = 32e6;  // bytes; with less, some libraries end the program
        require_address_space(kToBegin);
        if (const auto text = argc > 1 ? unknown_command(program, argv[1]) : std::nullopt) {
            std::fputs(text->c_str(), stderr);
            return 2;
        }
        require_shared_command(argc, argv);
        note_command_line(argc, argv);
        program.parse(argc, argv);
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            throw IoError("standard output: cannot write all of it; check space on the device it goes to");
        return 0;
    } catch (const CLI::ParseError& error) {
        // CLI11 throws for --help and --version, too, with the code 0.
        return program.exit(error) == 0 ? 0 : 2;
    } catch (const Error& error) {
        // A closed terminal does not change the exit code.
        return fail(fmt::format("sidewall: {}\n", surface::printable(error.what())).c_str(),
                    error.exit_code());
    } catch (const std::exception& error) {
        if (const char* message = message_of_limit(error)) return fail(message, 4);
        if (const auto* stream = dynamic_cast<const std::system_error*>(&error))  // fmt could not write
            return fail(
                fmt::format("sidewall: standard output: cannot write: {}; check space on the device it "
                            "goes to\n",
                            stream->code().message())
                    .c_str(),
                5);
        return fail(fmt::format("sidewall: internal error: {}\n", error.what()).c_str(), 4);
    }
}

}  // namespace

void install_terminate_handler() {
    std::set_terminate(end_in_terminate);
}

int run_program(int argc, char** argv) {
    // Keeps freed memory in the process: each time step allocates the arrays that the last one freed, and
    // memory that the system took back costs a page fault every 4 kB.
    ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
    ::mallopt(M_TRIM_THRESHOLD, 256 << 20);
    install_terminate_handler();
    secure_standard_streams();
    begin_rank();
    std::signal(SIGXFSZ, SIG_IGN);  // a file over the user's size limit fails in write()
    try {
        return end_rank(run(argc, argv));
    } catch (const std::bad_alloc&) {  // outside the handlers of run(), or inside them
        report_failure(kNoMemory, 4);
        return end_rank(4);
    } catch (...) {  // the message could not be written
        return end_rank(4);
    }
}

}  // namespace sidewall::app
