#pragma once
#include <string>

#include "surface/error.hpp"

namespace sidewall::app {

/// Does \p work and puts the file's name before its errors of geometry and numerics, unless they begin with it.
template <class Work>
auto about(const std::string& file, Work&& work) {
    const auto named = [&](const Error& error) {
        const std::string text = error.what();
        return text.starts_with(file) ? text : file + ": " + text;
    };
    try {
        return work();
    } catch (const GeometryError& error) {
        throw GeometryError(named(error));
    } catch (const NumericsError& error) {
        throw NumericsError(named(error));
    }
}

}  // namespace sidewall::app
