#pragma once
#include <pybind11/pybind11.h>

#include "app/process/simulation.hpp"

namespace sidewall::python {

/// A model's speeds from a Python callable, which is given arrays of all points at once (sidewall/__init__.pyi, Points)
/// and returns as many numbers.
/// \param law, recipe  outlive what is returned.
app::CallerLaw speeds_by(const pybind11::object& law, const app::Recipe& recipe);

}  // namespace sidewall::python
