#include <pybind11/pybind11.h>

#include "app/common/threads.hpp"
#include "app/common/version.hpp"
#include "surface/error.hpp"

namespace sidewall::python {

// Each part of the module lives in a file of its own, which adds its classes and functions.
void add_exceptions(pybind11::module_& module);
void add_mesh(pybind11::module_& module);
void add_geometry(pybind11::module_& module);
void add_tracing(pybind11::module_& module);
void add_recipe(pybind11::module_& module);
void add_simulation(pybind11::module_& module);

}  // namespace sidewall::python

PYBIND11_MODULE(_sidewall, module) {
    using namespace sidewall;
    module.doc() = "Etch and deposition on a virtual wafer: the compiled part of the package sidewall.";
    module.attr("__version__") = app::version();
    for (const auto add : {python::add_exceptions, python::add_mesh, python::add_geometry,
                           python::add_tracing, python::add_recipe, python::add_simulation})
        add(module);
    module.def("thread_count", &app::thread_count, "The number of threads in force.");
    module.def(
        "limit_threads",
        [](int count) {
            if (count < 1 || count > 1024)
                throw RecipeError("limit_threads(" + std::to_string(count) + "): must be in [1, 1024]");
            app::limit_threads(count);
        },
        pybind11::arg("count"),
        "Lets all work use no more threads from now on; results do not depend on it.");
}
