#include "app/recipe/flat.hpp"

#include <fmt/format.h>

namespace sidewall::app {

bool is_flat(const DomainSection& domain) {
    return domain.extent[1] == 0.0;
}

double width_of_strip(const Recipe& recipe) {
    return is_flat(recipe.domain) ? domain_of(recipe).spacing : 1.0;
}

std::string volume_unit(const Recipe& recipe) {
    return recipe.domain.length_unit + (is_flat(recipe.domain) ? "^2" : "^3");
}

void refuse_ends_along_y(const Layer& layer) {
    const auto refuse = [&](const char* key, const std::string& what, const char* instead) {
        throw KeyError(
            key, fmt::format("{}, but domain.extent has one number and the wafer is the same at all y: {}, "
                             "or give domain.extent two",
                             what, instead));
    };
    const std::string& shape = layer.shape;
    if (shape == "hole") refuse("shape", "a hole is round", "use a trench");
    if (shape == "box") refuse("shape", "a box ends along y", layer.subtract ? "use a trench" : "use a fin");
    if (shape == "sphere") refuse("shape", "a sphere is round", "use a cylinder along y");
    if (shape == "mask" || shape == "polygons")
        refuse("shape", layer.file.empty() ? "polygons are seen from above" : "a layout is seen from above",
               "use a trench");
    if (shape == "mesh") refuse("shape", "a mesh file has a y of its own", "use a profile");
    if (shape == "cylinder" && layer.axis != "y")
        refuse("axis", fmt::format("the cylinder lies along {}", layer.axis), "use \"y\"");
    if (shape == "cylinder" && layer.length) refuse("length", "the cylinder ends along y", "drop the length");
    if (shape == "gap" && layer.span) refuse("width", "the gap ends along y", "drop the width");
    if (shape == "profile" && layer.sweep == "revolution")
        refuse("sweep", "what is turned about an axis is round", "use \"extrusion\"");
}

}  // namespace sidewall::app
