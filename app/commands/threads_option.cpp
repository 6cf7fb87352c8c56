#include "app/commands/commands.hpp"
#include "app/common/threads.hpp"

namespace sidewall::app {

void add_threads_option(CLI::App& command) {
    command
        .add_option_function<int>("--threads", limit_threads,
                                  "Threads to use; results do not depend on it (default: all cores)")
        ->check(CLI::Range(1, 1024))
        ->trigger_on_parse()
        ->type_name("N");
}

}  // namespace sidewall::app
