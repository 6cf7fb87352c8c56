#include "app/recipe/recipe.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/notes.hpp"

#include <pybind11/stl.h>

#include <memory>

namespace sidewall::python {

namespace py = pybind11;

// Adds the class of recipes that are read and checked, which sidewall/recipe.py makes of files, texts and
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
        .def_property_readonly("notes", [](const app::Recipe& recipe) { return app::notes_on(recipe); });
}

}  // namespace sidewall::python
