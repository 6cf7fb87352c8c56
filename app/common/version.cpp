#include "app/common/version.hpp"

namespace sidewall::app {

const char* version() {
    return SIDEWALL_VERSION;
}

const char* built_with() {
    return SIDEWALL_BUILT_WITH;
}

}  // namespace sidewall::app
