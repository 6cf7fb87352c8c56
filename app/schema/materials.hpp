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

/// The id of the material that \p name means: one of that name, else the built-in one that it is a common word
/// for, such as photoresist for Resist or SiN for Si3N4.
std::optional<int> meant_material(const Materials& materials, std::string_view name);

/// A common word for a built-in material.
struct MaterialWord {
    const char* word;  ///< in small letters; capitals do not count
    const char* name;
};

const std::vector<MaterialWord>& material_words();

std::vector<std::string> material_names(const Materials& materials);

}  // namespace sidewall::app
