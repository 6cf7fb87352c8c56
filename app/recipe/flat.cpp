#include "app/recipe/flat.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace sidewall::app {
namespace {

// Whether all polygons are rectangles along the axes that reach farther along y than distances are kept for.
bool runs_along_y(const Layer& layer, double spacing) {
    const double far = kFarAlongY * spacing * (1.0 - 1e-9);
    return layer.file.empty() &&
           std::all_of(layer.polygons.begin(), layer.polygons.end(), [&](const Outline& outline) {
               const std::vector<double>& p = outline.points;
               return p.size() == 8 && p[0] == p[6] && p[2] == p[4] && p[1] == p[3] && p[5] == p[7] &&
                      p[1] <= -far && p[5] >= far;
           });
}

}  // namespace

bool is_flat(const DomainSection& domain) {
    return domain.extent[1] == 0.0;
}

double width_of_strip(const Recipe& recipe) {
    return is_flat(recipe.domain) ? domain_of(recipe).spacing : 1.0;
}

std::string volume_unit(const Recipe& recipe) {
    return recipe.domain.length_unit + (is_flat(recipe.domain) ? "^2" : "^3");
}

void refuse_ends_along_y(const Layer& layer, double spacing) {
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
    if ((shape == "mask" || shape == "polygons") && !layer.blur.empty())
        refuse("blur", "what prints is seen from above", "drop it");
    if ((shape == "mask" || shape == "polygons") && !runs_along_y(layer, spacing))
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
