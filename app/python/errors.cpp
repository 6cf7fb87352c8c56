#include <pybind11/pybind11.h>

#include "surface/error.hpp"

namespace sidewall::python {
namespace {

namespace py = pybind11;

// Python's exception classes for the program's errors; they live as long as the interpreter.
struct Errors {
    PyObject *any, *recipe, *file, *geometry, *numerics, *io;
};
Errors errors;

PyObject* of(const Error& error) {
    if (dynamic_cast<const RecipeError*>(&error) != nullptr) return errors.recipe;
    if (dynamic_cast<const FileError*>(&error) != nullptr) return errors.file;
    if (dynamic_cast<const GeometryError*>(&error) != nullptr) return errors.geometry;
    if (dynamic_cast<const NumericsError*>(&error) != nullptr) return errors.numerics;
    if (dynamic_cast<const IoError*>(&error) != nullptr) return errors.io;
    if (dynamic_cast<const Interrupted*>(&error) != nullptr) return PyExc_KeyboardInterrupt;
    return errors.any;
}

PyObject* add(py::module_& module, const char* name, const char* doc, const py::tuple& bases) {
    const std::string path = std::string("sidewall.") + name;
    PyObject* type = PyErr_NewExceptionWithDoc(path.c_str(), doc, bases.ptr(), nullptr);
    if (type == nullptr) throw py::error_already_set();
    module.attr(name) = py::reinterpret_borrow<py::object>(type);
    return type;
}

}  // namespace

void add_exceptions(py::module_& module) {
    const auto both = [&](PyObject* python) {
        return py::make_tuple(py::handle(errors.any), py::handle(python));
    };
    errors.any = add(module, "Error", "What the program refuses or fails at, in its own words.",
                     py::make_tuple(py::handle(PyExc_Exception)));
    errors.recipe =
        add(module, "RecipeError", "A recipe or option that makes no sense.", both(PyExc_ValueError));
    errors.file = add(module, "FileError", "An input file that is missing, damaged or of the wrong kind.",
                      both(PyExc_OSError));
    errors.geometry =
        add(module, "GeometryError", "A mesh or grid that cannot be worked on.", both(PyExc_ValueError));
    errors.numerics =
        add(module, "NumericsError", "No solution: not a number, no surface left, particles that leak.",
            both(PyExc_ArithmeticError));
    errors.io = add(module, "IoError", "An output that could not be written.", both(PyExc_OSError));
    // NOLINTNEXTLINE(performance-unnecessary-value-param): the signature that pybind11 asks for
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Error& error) {
            PyErr_SetString(of(error), error.what());
        }
    });
}

}  // namespace sidewall::python
