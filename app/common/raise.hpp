#pragma once
#include <fmt/format.h>

#include <utility>

#include "surface/error.hpp"

namespace sidewall::app {

/// Throws an error with a message that fmt formats.
template <class Kind, class... Args>
[[noreturn]] void raise(fmt::format_string<Args...> message, Args&&... args) {
    throw Kind(fmt::format(message, std::forward<Args>(args)...));
}

}  // namespace sidewall::app
