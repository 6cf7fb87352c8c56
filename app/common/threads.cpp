#include "app/common/threads.hpp"

#include <tbb/global_control.h>

#include <memory>

namespace sidewall::app {
namespace {

std::unique_ptr<tbb::global_control> limit;

}  // namespace

int thread_count() {
    return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void limit_threads(int count) {
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(count));
}

}  // namespace sidewall::app
