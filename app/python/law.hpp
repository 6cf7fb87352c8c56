#pragma once
#include <pybind11/pybind11.h>

#include "app/process/simulation.hpp"

namespace sidewall::python {

/// A speed law that calls a Python function, with arrays of all points at once (Points in sidewall/__init__.pyi), for
/// as many speeds.
/// \pre law and recipe outlive it.
app::CallerLaw speeds_by(const pybind11::object& law, const app::Recipe& recipe);

}  // namespace sidewall::python
