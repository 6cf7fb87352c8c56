#include "app/commands/flux_species.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/common/text.hpp"

namespace sidewall::app {
namespace {

double parse_probability(const std::string& text, const std::string& where) {
    const double value = parse_number<double>(text, where);
    if (!(value >= 0.0 && value <= 1.0)) throw RecipeError(fmt::format("{}: must be in [0, 1]", where));
    return value;
}

// Parses one sticking probability, or one for each of the ids in their order.
std::vector<double> parse_sticking(const std::string& text, const std::vector<std::int32_t>& ids,
                                   const std::string& path) {
    if (text.find('=') == std::string::npos) return {parse_probability(text, "--sticking " + text)};
    std::vector<double> sticking(ids.size(), -1.0);
    for (const std::string& part : split(text, ',')) {
        const std::string where = "--sticking " + part;
        const auto equals = part.find('=');
        if (equals == std::string::npos)
            throw RecipeError(where + ": write ID=s, as in --sticking 0=0.1,1=0.5");
        const auto id = parse_number<std::int32_t>(part.substr(0, equals), where);
        const double value = parse_probability(part.substr(equals + 1), where);
        const auto found = std::lower_bound(ids.begin(), ids.end(), id);
        if (found == ids.end() || *found != id)
            throw RecipeError(
                fmt::format("{}: {} has no material {}; it has {}", where, path, id, fmt::join(ids, ", ")));
        double& slot = sticking[static_cast<std::size_t>(found - ids.begin())];
        if (slot >= 0.0) throw RecipeError(fmt::format("{}: material {} is given twice", where, id));
        slot = value;
    }
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (sticking[i] < 0.0)
            throw RecipeError(fmt::format("--sticking {}: material {} of {} is missing", text, ids[i], path));
    return sticking;
}

}  // namespace

FluxMaterials flux_materials(const TriangleMesh& mesh, const std::string& path) {
    const Attribute* attribute = mesh.triangle_attribute("material");
    if (!attribute) return {{0}, {}};
    if (attribute->components != 1 || attribute->values.size() != mesh.triangles.size())
        throw FileError(fmt::format("{}: attribute material must be one integer a triangle", path));
    FluxMaterials materials;
    for (std::size_t t = 0; t < attribute->values.size(); ++t) {
        const double value = attribute->values[t];
        if (!(std::abs(value) <= 2147483647.0) || value != std::floor(value))
            throw FileError(
                fmt::format("{}: triangle {} has material {}: must be an integer", path, t, value));
        materials.of_triangle.push_back(static_cast<std::int32_t>(value));
    }
    materials.ids = materials.of_triangle;
    std::sort(materials.ids.begin(), materials.ids.end());
    materials.ids.erase(std::unique(materials.ids.begin(), materials.ids.end()), materials.ids.end());
    for (std::int32_t& id : materials.of_triangle)
        id = static_cast<std::int32_t>(std::lower_bound(materials.ids.begin(), materials.ids.end(), id) -
                                       materials.ids.begin());
    return materials;
}

flux::Species species_of(const FluxSource& source, const TriangleMesh& mesh, const FluxMaterials& materials,
                         const std::string& path) {
    flux::Species species{"flux", source.exponent, parse_sticking(source.sticking, materials.ids, path)};
    if (!source.mean_free_path) return species;
    // Diffusion over n mean free paths takes about n^2 collisions.
    constexpr double kLeast = 1e-3;  // of the surface's size
    const double least = kLeast * bounding_box(mesh).size().norm();
    if (!(*source.mean_free_path >= least))
        throw RecipeError(fmt::format(
            "--mean-free-path {:g}: particles would collide too often to be followed: give a length of "
            "{:.3g} or more, a thousandth of the surface's size",
            *source.mean_free_path, least));
    species.mean_free_path = *source.mean_free_path;
    return species;
}

}  // namespace sidewall::app
