#include "app/common/version.hpp"

namespace sidewall::app {

const char* version() {
    return SIDEWALL_VERSION;
}

}  // namespace sidewall::app
