#include <fmt/format.h>

#include <set>

#include "app/recipe/sections.hpp"

namespace sidewall::app {
namespace {

void add(std::vector<KeyDoc>& keys, const std::string& path, std::vector<KeyDoc> rows) {
    for (KeyDoc& row : rows) {
        row.name = fmt::format("{}.{}", path, row.name);
        for (auto list = row.name.find("[]."); list != std::string::npos; list = row.name.find("[]."))
            row.name.replace(list, 2, "[0]");
        keys.push_back(std::move(row));
    }
}

void add_steps(std::vector<KeyDoc>& keys, const std::string& path, std::vector<Step>& steps) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const std::string step = fmt::format("{}[{}]", path, i);
        add(keys, step, document(fields(steps[i])));
        add_steps(keys, step + ".steps", steps[i].steps);
    }
}

// Of "[[step]] model = ..." step[0], of "[flux]" flux.
std::string path_of(const std::string& header) {
    const bool list = header.starts_with("[[");
    const std::size_t begin = list ? 2 : 1;
    return fmt::format("{}{}", header.substr(begin, header.find(']') - begin), list ? "[0]" : "");
}

}  // namespace

std::vector<KeyDoc> settable_keys(Recipe recipe) {
    std::vector<KeyDoc> keys;
    for (SectionDoc& section : recipe_documentation())
        if (!section.header.starts_with("[[")) add(keys, path_of(section.header), std::move(section.keys));
    for (std::size_t i = 0; i < recipe.layers.size(); ++i)
        add(keys, fmt::format("layer[{}]", i), document(fields(recipe.layers[i])));
    add_steps(keys, "step", recipe.steps);
    return keys;
}

std::vector<KeyDoc> settable_keys() {
    std::vector<KeyDoc> keys;
    for (SectionDoc& section : recipe_documentation())
        add(keys, path_of(section.header), std::move(section.keys));
    std::set<std::string> seen;  // shapes and models share keys
    std::erase_if(keys, [&](const KeyDoc& key) { return !seen.insert(key.name).second; });
    return keys;
}

}  // namespace sidewall::app
