#pragma once
#include <pybind11/pybind11.h>

// One function a part of the module: adds its classes and functions.
namespace sidewall::python {

void add_errors(pybind11::module_& module);
void add_mesh(pybind11::module_& module);
void add_geometry(pybind11::module_& module);
void add_tracing(pybind11::module_& module);
void add_recipe(pybind11::module_& module);
void add_simulation(pybind11::module_& module);

}  // namespace sidewall::python
