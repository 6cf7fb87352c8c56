#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>

#include "app/common/processes.hpp"
#include "app/common/version.hpp"
#include "app/process/estimate/blanket.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "surface/error.hpp"

namespace py = pybind11;

namespace sidewall::python {

// Each adds its classes and functions: arrays.cpp, geometry.cpp, tracing.cpp, run_object.cpp.
void add_mesh(py::module_& module);
void add_geometry(py::module_& module);
void add_tracing(py::module_& module);
void add_simulation(py::module_& module);

namespace {

template <class Kind>
py::object add_exception(py::module_& module, const char* name, const py::object& bases, const char* doc) {
    py::object type = py::register_exception<Kind>(module, name, bases);
    type.attr("__module__") = "sidewall";
    type.doc() = doc;
    return type;
}

void add_exceptions(py::module_& module) {
    const py::object any =
        add_exception<Error>(module, "Error", py::reinterpret_borrow<py::object>(PyExc_Exception),
                             "Base class of the errors that Sidewall raises; the text says what is wrong.");
    const auto both = [&](PyObject* python) { return py::make_tuple(any, py::handle(python)); };
    add_exception<RecipeError>(module, "RecipeError", both(PyExc_ValueError),
                               "A recipe or option with a wrong key or value.");
    add_exception<FileError>(module, "FileError", both(PyExc_OSError),
                             "An input file that is missing, damaged or of the wrong kind.");
    add_exception<GeometryError>(module, "GeometryError", both(PyExc_ValueError),
                                 "A mesh or grid that cannot be used, such as one that is no manifold.");
    add_exception<NumericsError>(
        module, "NumericsError", both(PyExc_ArithmeticError),
        "Numerical failure: NaN values, no surface left, or particles that pass through the surface.");
    add_exception<IoError>(module, "IoError", both(PyExc_OSError), "An output that could not be written.");
    // NOLINTNEXTLINE(performance-unnecessary-value-param): the signature that pybind11 asks for
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            if (thrown) std::rethrow_exception(thrown);
        } catch (const Interrupted& error) {
            PyErr_SetString(PyExc_KeyboardInterrupt, error.what());
        }
    });
}

// Adds ReadRecipe, a recipe that was read and checked; sidewall/recipe.py makes it from files, texts or
// dicts.
void add_recipe(py::module_& module) {
    using Settings = std::vector<std::string>;
    py::class_<app::Recipe, std::shared_ptr<app::Recipe>>(module, "ReadRecipe")
        .def_static(
            "load",
            [](const std::string& path, const Settings& settings) {
                return std::make_shared<app::Recipe>(app::load_recipe(path, settings));
            },
            py::arg("path"), py::arg("settings"))
        .def_static(
            "parse",
            [](const std::string& text, const std::string& name, const Settings& settings) {
                return std::make_shared<app::Recipe>(app::parse_recipe(text, name, settings));
            },
            py::arg("text"), py::arg("name"), py::arg("settings"))
        .def_property_readonly("effective",
                               [](const app::Recipe& recipe) { return app::effective_recipe(recipe); })
        .def_property_readonly("notes",
                               [](const app::Recipe& recipe) { return app::notes_before_run(recipe); });
}

}  // namespace
}  // namespace sidewall::python

PYBIND11_MODULE(_sidewall, module) {
    using namespace sidewall;
    module.doc() = "Etch and deposition on a virtual wafer: the compiled part of the package sidewall.";
    module.attr("__version__") = app::version();
    for (const auto add : {python::add_exceptions, python::add_mesh, python::add_geometry,
                           python::add_tracing, python::add_recipe, python::add_simulation})
        add(module);
    module.def("thread_count", &app::thread_count, "Returns the number of threads in use.");
    module.def(
        "limit_threads",
        [](int count) {
            if (count < 1 || count > 1024)
                throw RecipeError("limit_threads(" + std::to_string(count) + "): must be in [1, 1024]");
            app::limit_threads(count);
        },
        py::arg("count"),
        "Sets the largest number of threads for all further work; results do not depend on it.");
}
