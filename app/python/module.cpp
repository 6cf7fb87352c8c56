#include "app/python/module.hpp"

#include "app/common/threads.hpp"
#include "app/common/version.hpp"
#include "surface/error.hpp"

PYBIND11_MODULE(_sidewall, module) {
    using namespace sidewall;
    module.doc() = "Etch and deposition on a virtual wafer: the compiled part of the package sidewall.";
    module.attr("__version__") = app::version();
    python::add_errors(module);
    python::add_mesh(module);
    python::add_geometry(module);
    python::add_tracing(module);
    python::add_recipe(module);
    python::add_simulation(module);
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
