#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// A material that layers are made of.
struct Material {
    std::string name;
    std::string colour = "#b0b0b0";  ///< in pictures, hexadecimal as in "\#rrggbb"
    double density = 5.0;            ///< atoms, or formula units of a compound, 1e22 /cm^3
    bool operator==(const Material&) const = default;
};

/// The materials by id. The built-in ones come first and always in the same order, so that an id means the
/// same in every run; a recipe's own follow.
using Materials = std::vector<Material>;

/// The built-in materials.
const Materials& default_materials();

/// The id of the material of that name, if there is one.
std::optional<int> material_id(const Materials& materials, std::string_view name);

std::vector<std::string> material_names(const Materials& materials);

}  // namespace sidewall::app
