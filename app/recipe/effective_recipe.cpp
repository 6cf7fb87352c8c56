#include "app/recipe/effective_recipe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/recipe/layers.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/steps.hpp"
#include "app/schema/units.hpp"

namespace sidewall::app {
namespace {

// Takes a copy of the section, because keys point to writable members.
template <class Section>
std::string section_text(const std::string& header, Section section, const DomainSection& units) {
    std::string text = fmt::format("\n{}\n", header);
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

// Adds the materials that a key's value names, and other strings.
void collect(const Key& key, std::set<std::string>& names) {
    // A table without a value for all other materials lists published numbers, not the user's choice.
    if (auto* by_material = std::get_if<ByMaterial*>(&key.target); by_material && (*by_material)->fallback)
        for (const auto& [name, number] : (*by_material)->named) names.insert(name);
    if (auto* expressions = std::get_if<Expressions*>(&key.target))
        for (const auto& [name, text] : (*expressions)->named) names.insert(name);
    if (auto* text = std::get_if<std::string*>(&key.target)) names.insert(**text);
    if (auto* list = std::get_if<std::vector<std::string>*>(&key.target))
        names.insert((*list)->begin(), (*list)->end());
}

// Tables of the materials that the recipe names or that differ from the built-in ones, by ascending id.
std::string materials_text(const Recipe& recipe) {
    std::set<std::string> named;
    for (const Layer& layer : recipe.layers) {
        named.insert(layer.material);
        named.insert(layer.materials.begin(), layer.materials.end());
    }
    each_step(recipe.steps, [&](const Step& step, const std::string&) {
        each_key(model_keys(step), [&](const Key& key, const std::string&) { collect(key, named); });
        named.insert(step.stop_material);
    });
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
        Step plain = step;
        plain.chemistry.clear();  // all of the deck's keys are written here
        text += section_text("[[" + header + "]]", plain, units);
        text += steps_text(step.steps, header + ".steps", units);
    }
    return text;
}

std::string value_of(const std::vector<Key>& keys, const std::string& key) {
    for (const Key& other : keys)
        if (other.name == key) return toml_text(other).value_or("absent");
    return "absent";
}

// Takes copies of the sections, because keys point to writable members.
template <class Section>
void compare(const std::string& path, Section now, Section there, std::vector<std::string>& list) {
    const std::vector<Key> here = keys_of(now), then = keys_of(there);
    std::vector<std::string> keys;
    for (const auto* all : {&here, &then})
        for (const Key& key : *all)
            if (std::find(keys.begin(), keys.end(), key.name) == keys.end()) keys.push_back(key.name);
    for (const std::string& key : keys)
        if (const std::string a = value_of(here, key), b = value_of(then, key); a != b)
            list.push_back(fmt::format("{}{} = {} (there {})", path, key, a, b));
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

std::vector<std::string> differences(const Recipe& now, const Recipe& there) {
    std::vector<std::string> list;
    compare("domain.", now.domain, there.domain, list);
    compare("grid.", now.grid, there.grid, list);
    compare("start.", now.start, there.start, list);
    for (std::size_t id = 0; id < there.materials.size(); ++id)
        if (id >= now.materials.size())
            list.push_back(fmt::format("material {} is missing", there.materials[id].name));
        else
            compare(fmt::format("material {}: ", there.materials[id].name), now.materials[id],
                    there.materials[id], list);
    if (now.layers.size() != there.layers.size())
        list.push_back(fmt::format("{} layers (there {})", now.layers.size(), there.layers.size()));
    for (std::size_t k = 0; k < std::min(now.layers.size(), there.layers.size()); ++k)
        compare(fmt::format("layer[{}].", k), now.layers[k], there.layers[k], list);
    compare("flux.", now.flux, there.flux, list);
    compare("simplify.", now.simplify, there.simplify, list);
    compare("advection.", now.advection, there.advection, list);
    compare("output.", now.output, there.output, list);
    compare("metrology.", now.metrology, there.metrology, list);
    return list;
}

std::vector<std::string> differences(const Step& now, const Step& there) {
    std::vector<std::string> list;
    Step unnamed = now;
    unnamed.name = there.name;
    unnamed.chemistry = there.chemistry;  // the keys that it gave are compared
    compare("", unnamed, there, list);
    return list;
}

}  // namespace sidewall::app
