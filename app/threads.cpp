#include <tbb/global_control.h>
#include <tbb/info.h>

#include <memory>

#include "app/commands.hpp"

namespace sidewall::app {
namespace {

std::unique_ptr<tbb::global_control> limit;

}  // namespace

int thread_count() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void add_threads_option(CLI::App& command) {
    command
        .add_option_function<int>(
            "--threads",
            [](int n) {
                limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                              static_cast<std::size_t>(n));
            },
            "Threads to use; results do not depend on it (default: all cores)")
        ->check(CLI::Range(1, 1024))
        ->trigger_on_parse()
        ->type_name("N");
}

}  // namespace sidewall::app
