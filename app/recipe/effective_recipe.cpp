#include "app/recipe/effective_recipe.hpp"

#include <fmt/format.h>

#include <set>

#include "app/recipe/layer_keys.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/steps.hpp"
#include "app/schema/units.hpp"

namespace sidewall::app {
namespace {

// Sections are copied: keys point to members that could be written, though they are only read here.
template <class Section>
std::string keys_text(Section section, const DomainSection& units) {
    std::string text;
    for (const Key& key : keys_of(section)) {
        const auto value = toml_text(key);
        if (!value) continue;
        text += fmt::format("{} = {}", key.name, *value);
        if (!key.unit.empty())
            text += fmt::format("  # {}", unit_text(key.unit, units.length_unit, units.time_unit));
        text += "\n";
    }
    return text;
}

template <class Section>
std::string section_text(const std::string& header, const Section& section, const DomainSection& units) {
    return fmt::format("\n{}\n{}", header, keys_text(section, units));
}

void collect(const std::vector<Key>& keys, std::set<std::string>& names) {
    for (const Key& key : keys) {
        // Without a value for all others a table lists what is published, wanted or not.
        if (auto* by_material = std::get_if<ByMaterial*>(&key.target);
            by_material && (*by_material)->fallback)
            for (const auto& [name, number] : (*by_material)->named) names.insert(name);
        if (auto* expressions = std::get_if<Expressions*>(&key.target))
            for (const auto& [name, text] : (*expressions)->named) names.insert(name);
        if (auto* text = std::get_if<std::string*>(&key.target)) names.insert(**text);
        if (auto* list = std::get_if<std::vector<std::string>*>(&key.target))
            names.insert((*list)->begin(), (*list)->end());
        if (auto* tables = std::get_if<TableList>(&key.target))
            for (std::size_t i = 0; i < tables->size(); ++i) collect(tables->keys(i), names);
    }
}

void collect(const std::vector<Step>& steps, std::set<std::string>& names) {
    for (const Step& step : steps) {
        collect(model_keys(step), names);
        names.insert(step.stop_material);
        collect(step.steps, names);
    }
}

// Materials that the recipe names, and those that are not as built in; in the order of their ids.
std::string materials_text(const Recipe& recipe) {
    std::set<std::string> named;
    for (const Layer& layer : recipe.layers) {
        named.insert(layer.material);
        named.insert(layer.materials.begin(), layer.materials.end());
    }
    collect(recipe.steps, named);
    const Materials& built_in = default_materials();
    std::string text;
    for (std::size_t id = 0; id < recipe.materials.size(); ++id) {
        const Material& material = recipe.materials[id];
        if (named.contains(material.name) || id >= built_in.size() || !(material == built_in[id]))
            text += section_text("[[material]]", material, recipe.domain);
    }
    return text;
}

std::string steps_text(const std::vector<Step>& steps, const std::string& header,
                       const DomainSection& units) {
    std::string text;
    for (const Step& step : steps) {
        text += section_text("[[" + header + "]]", step, units);
        text += steps_text(step.steps, header + ".steps", units);
    }
    return text;
}

}  // namespace

std::string effective_recipe(const Recipe& recipe) {
    std::string text = fmt::format("# Every key in force. Lengths in {}, times in {}.\n",
                                   recipe.domain.length_unit, recipe.domain.time_unit);
    const DomainSection& units = recipe.domain;
    text += section_text("[domain]", recipe.domain, units);
    text += section_text("[grid]", recipe.grid, units);
    if (!recipe.start.from.empty()) text += section_text("[start]", recipe.start, units);
    text += materials_text(recipe);
    for (const Layer& layer : recipe.layers) text += section_text("[[layer]]", layer, units);
    text += steps_text(recipe.steps, "step", units);
    text += section_text("[flux]", recipe.flux, units);
    text += section_text("[simplify]", recipe.simplify, units);
    text += section_text("[advection]", recipe.advection, units);
    text += section_text("[output]", recipe.output, units);
    text += section_text("[metrology]", recipe.metrology, units);
    return text;
}

}  // namespace sidewall::app
