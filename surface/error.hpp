#pragma once
#include <fmt/core.h>

#include <stdexcept>
#include <utility>

namespace sidewall {

/// Base of the errors that a user can meet, one type per cause. The message says where, what and what to do.
class Error : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
    /// Formats the message as fmt::format() does.
    template <class First, class... Rest>
    Error(fmt::format_string<First, Rest...> text, First&& first, Rest&&... rest)
        : runtime_error(fmt::format(text, std::forward<First>(first), std::forward<Rest>(rest)...)) {}
    virtual int exit_code() const noexcept = 0;
};

/// Bad command line or recipe.
class RecipeError : public Error {
  public:
    using Error::Error;
    int exit_code() const noexcept override { return 2; }
};

/// An input file that is missing, damaged or of the wrong format.
class FileError : public Error {
  public:
    using Error::Error;
    int exit_code() const noexcept override { return 3; }
};

/// A mesh that an algorithm cannot work on: not manifold, no area, wrong boundary.
class GeometryError : public Error {
  public:
    using Error::Error;
    int exit_code() const noexcept override { return 3; }
};

/// NaN, empty surface, leaked particles.
class NumericsError : public Error {
  public:
    using Error::Error;
    int exit_code() const noexcept override { return 4; }
};

/// An output that could not be written.
class IoError : public Error {
  public:
    using Error::Error;
    int exit_code() const noexcept override { return 5; }
};

/// The user asked to stop; what was finished is on disk.
class Interrupted : public Error {
  public:
    using Error::Error;
    int exit_code() const noexcept override { return 130; }
};

}  // namespace sidewall
