#include "app/common/timing.hpp"

#include <chrono>
#include <ctime>

namespace sidewall::app {

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double cpu_seconds() {
    return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

}  // namespace sidewall::app
