#include "app/schema/materials.hpp"

#include <algorithm>

namespace sidewall::app {

const Materials& default_materials() {
    // Densities from mass density and formula weight. The mask is an ideal one that hardly sputters. Ids are
    // written to files: append only.
    static const Materials table = {
        {"Si", "#8fa3b8", 5.02},    {"SiO2", "#e0b060", 2.2},   {"Si3N4", "#6fb58a", 1.36},
        {"PolySi", "#7d7fb5", 5.0}, {"SiGe", "#b58fb8", 4.8},   {"Ge", "#9a86a8", 4.42},
        {"Mask", "#c8584c", 500.0}, {"Resist", "#d98ca0", 0.6}, {"Polymer", "#78c0c8", 2.2},
        {"W", "#70757c", 6.31},     {"TiN", "#a8862c", 5.26},   {"Al2O3", "#d8d4e4", 2.33},
        {"HfO2", "#88a850", 2.77},  {"Cu", "#c8743c", 8.49},    {"Carbon", "#3c4048", 10.0},
    };
    return table;
}

std::optional<int> material_id(const Materials& materials, std::string_view name) {
    const auto found = std::find_if(materials.begin(), materials.end(),
                                    [&](const Material& material) { return material.name == name; });
    if (found == materials.end()) return std::nullopt;
    return static_cast<int>(found - materials.begin());
}

const std::vector<MaterialWord>& material_words() {
    static const std::vector<MaterialWord> words = {
        {"silicon", "Si"},         {"c-si", "Si"},
        {"oxide", "SiO2"},         {"quartz", "SiO2"},
        {"sin", "Si3N4"},          {"nitride", "Si3N4"},
        {"poly", "PolySi"},        {"poly-si", "PolySi"},
        {"polysilicon", "PolySi"}, {"germanium", "Ge"},
        {"photoresist", "Resist"}, {"pr", "Resist"},
        {"tungsten", "W"},         {"alumina", "Al2O3"},
        {"hafnia", "HfO2"},        {"copper", "Cu"},
        {"a-c", "Carbon"},         {"carbon", "Carbon"},
        {"resist", "Resist"},      {"polymer", "Polymer"},
        {"mask", "Mask"},          {"fluorocarbon", "Polymer"},
    };
    return words;
}

std::optional<int> meant_material(const Materials& materials, std::string_view name) {
    if (const auto id = material_id(materials, name)) return id;
    const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    const auto same = [&](std::string_view word) {
        return std::equal(word.begin(), word.end(), name.begin(), name.end(),
                          [&](char a, char b) { return a == small(b); });
    };
    for (const auto& [word, built_in] : material_words())
        if (same(word)) return material_id(materials, built_in);
    return std::nullopt;
}

std::vector<std::string> material_names(const Materials& materials) {
    std::vector<std::string> names;
    for (const Material& material : materials) names.push_back(material.name);
    return names;
}

}  // namespace sidewall::app
