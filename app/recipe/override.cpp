#include "app/recipe/override.hpp"

#include <fmt/format.h>

#include "app/recipe/node_path.hpp"
#include "app/recipe/reader.hpp"

namespace sidewall::app {
namespace {

// A table { v = value } whose nodes name the override as their source. What is not TOML but starts like a
// word is a string: lindstrom-turk, y=0.
toml::table parse_value(const std::string& text, const std::string& source) {
    const bool word =
        !text.empty() && (key_character(text[0]) && !(text[0] >= '0' && text[0] <= '9') && text[0] != '-');
    if (line_of_deep_key("v = " + text) > 0)
        throw RecipeError(fmt::format("{}: a key of over {} parts", source, kMostKeyParts));
    try {
        toml::table table = toml::parse("v = " + text, std::string_view(source));
        if (table.size() == 1 && text.find('\n') == std::string::npos) return table;
    } catch (const toml::parse_error& error) {
        if (word) return toml::parse("v = " + toml_text(text), std::string_view(source));
        throw RecipeError(fmt::format("{}: not a TOML value: {}", source, error.description()));
    }
    throw RecipeError(fmt::format("{}: must be one value on one line", source));
}

toml::node* child(toml::node& node, const PathPart& part, std::size_t indices, const std::string& source) {
    toml::node* found = node.as_table()->get(part.key);
    for (std::size_t i = 0; i < indices && found != nullptr; ++i) {
        toml::array* array = found->as_array();
        if (array == nullptr)
            throw RecipeError(fmt::format("{}: {} is not a list in the recipe", source, part.key));
        if (part.indices[i] >= array->size())
            throw RecipeError(fmt::format("{}: {}[{}]: the recipe has {}, counted from 0", source, part.key,
                                          part.indices[i], array->size()));
        found = array->get(part.indices[i]);
    }
    return found;
}

}  // namespace

void apply_override(toml::table& root, const std::string& setting) {
    constexpr std::size_t kShown = 200;
    const std::string source =
        fmt::format("--set {}{}", setting.substr(0, kShown), setting.size() > kShown ? "..." : "");
    const std::size_t equals = setting.find('=');
    std::vector<PathPart> parts;
    try {
        if (equals != std::string::npos)
            parts = split_path(with_place_of_step(setting.substr(0, equals), named_steps(root)));
    } catch (const RecipeError& error) {
        throw RecipeError(fmt::format("{}: {}", source, error.what()));
    }
    if (parts.empty())
        throw RecipeError(fmt::format(
            "{}: must be key=value, e.g. step[0].duration=2, step.etch.duration=2 of the step with that "
            "name, or flux.rays=1000",
            source));
    toml::table value = parse_value(setting.substr(equals + 1), source);

    toml::node* node = &root;
    for (std::size_t p = 0; p + 1 < parts.size(); ++p) {
        toml::node* next = child(*node, parts[p], parts[p].indices.size(), source);
        if (next == nullptr && parts[p].indices.empty()) {
            toml::table made = parse_value("{}", source);
            node->as_table()->insert_or_assign(parts[p].key, std::move(*made.get("v")->as_table()));
            next = node->as_table()->get(parts[p].key);
        }
        if (next == nullptr) throw RecipeError(fmt::format("{}: the recipe has no {}", source, parts[p].key));
        if (!next->is_table())
            throw RecipeError(
                fmt::format("{}: {} holds no keys in the recipe{}", source, parts[p].key,
                            next->is_array() ? "; give an index, e.g. " + parts[p].key + "[0]" : ""));
        node = next;
    }

    const PathPart& last = parts.back();
    value.get("v")->visit([&](auto& v) {
        if (last.indices.empty()) {
            node->as_table()->insert_or_assign(last.key, std::move(v));
            return;
        }
        if (child(*node, last, last.indices.size(), source) == nullptr)
            throw RecipeError(fmt::format("{}: the recipe has no {}", source, last.key));
        toml::array* array = child(*node, last, last.indices.size() - 1, source)->as_array();
        array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(last.indices.back()), std::move(v));
    });
}

std::optional<double> written_number(const std::string& text, const std::string& file,
                                     const std::vector<std::string>& overrides, const std::string& key) {
    toml::table root = parse_toml(text, file);
    for (const std::string& setting : overrides) apply_override(root, setting);
    const toml::node* node = find_node(root, with_place_of_step(key, named_steps(root)));
    return node == nullptr ? std::nullopt : node->value<double>();
}

}  // namespace sidewall::app
