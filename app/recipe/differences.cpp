#include "app/recipe/differences.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/recipe/layer_keys.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/steps.hpp"

namespace sidewall::app {
namespace {

std::string value_of(const std::vector<Key>& keys, const std::string& key) {
    for (const Key& other : keys)
        if (other.name == key) return toml_text(other).value_or("absent");
    return "absent";
}

// Sections are copied: keys point to members that could be written, though they are only read here.
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
    compare("", unnamed, there, list);
    return list;
}

}  // namespace sidewall::app
