#include "app/recipe/node_path.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "app/recipe/decks.hpp"
#include "app/recipe/reader.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Collects names to the depth that a path may have; the reader refuses recipes that nest deeper.
void collect_names(const toml::node* list, const std::string& path, std::size_t depth,
                   std::vector<NamedStep>& found) {
    const toml::array* steps = list == nullptr ? nullptr : list->as_array();
    for (std::size_t i = 0; steps != nullptr && depth < kMostKeyParts && i < steps->size(); ++i) {
        const toml::table* step = (*steps)[i].as_table();
        if (step == nullptr) continue;
        const std::string here = fmt::format("{}[{}]", path, i);
        if (const auto name = (*step)["name"].value<std::string>()) found.push_back({*name, here});
        collect_names(step->get("steps"), here + ".steps", depth + 1, found);
    }
}

// A table { v = value } whose nodes have the override as their source. Text that is not TOML but begins like
// a word becomes a string: lindstrom-turk, y=0.
toml::table parse_value(const std::string& text, const std::string& source) {
    const bool word =
        !text.empty() && (key_character(text[0]) && !(text[0] >= '0' && text[0] <= '9') && text[0] != '-');
    if (line_of_deep_key("v = " + text) > 0)
        throw RecipeError("{}: a key of over {} parts", source, kMostKeyParts);
    try {
        toml::table table = toml::parse("v = " + text, std::string_view(source));
        if (table.size() == 1 && text.find('\n') == std::string::npos) return table;
    } catch (const toml::parse_error& error) {
        if (word) return toml::parse("v = " + toml_text(text), std::string_view(source));
        throw RecipeError("{}: not a TOML value: {}", source, error.description());
    }
    throw RecipeError("{}: must be one value on one line", source);
}

toml::node* child(toml::node& node, const PathPart& part, std::size_t indices, const std::string& source) {
    toml::node* found = node.as_table()->get(part.key);
    for (std::size_t i = 0; i < indices && found != nullptr; ++i) {
        toml::array* array = found->as_array();
        if (array == nullptr) throw RecipeError("{}: {} is not a list in the recipe", source, part.key);
        if (part.indices[i] >= array->size())
            throw RecipeError("{}: {}[{}]: the recipe has {}, counted from 0", source, part.key,
                              part.indices[i], array->size());
        found = array->get(part.indices[i]);
    }
    return found;
}

// Position after the quotes that open at \p from. In double quotes a backslash precedes \ and ".
std::size_t end_of_quoted(std::string_view text, std::size_t from) {
    for (std::size_t k = from + 1; k < text.size(); ++k) {
        if (text[k] == text[from]) return k + 1;
        if (text[from] == '"' && text[k] == '\\') ++k;
    }
    return std::string_view::npos;
}

}  // namespace

std::size_t end_of_key(std::string_view setting) {
    std::size_t k = 0;
    while (k < setting.size() && setting[k] != '=')
        k = setting[k] == '"' || setting[k] == '\'' ? end_of_quoted(setting, k) : k + 1;
    return k < setting.size() ? k : std::string_view::npos;
}

std::vector<PathPart> split_path(std::string_view path) {
    std::vector<PathPart> parts;
    std::size_t i = 0;
    while (true) {
        PathPart part;
        if (i < path.size() && (path[i] == '"' || path[i] == '\'')) {
            const std::size_t end = end_of_quoted(path, i);
            if (end == std::string_view::npos) return {};
            for (std::size_t k = i + 1; k + 1 < end; ++k)
                part.key += path[i] == '"' && path[k] == '\\' ? path[++k] : path[k];
            i = end;
        } else {
            while (i < path.size() && key_character(path[i])) part.key += path[i++];
        }
        if (part.key.empty()) return {};
        while (i < path.size() && path[i] == '[') {
            const std::size_t end = path.find(']', i);
            if (end == std::string_view::npos) return {};
            std::size_t index = 0;
            if (!surface::read_number(path.substr(i + 1, end - i - 1), index)) return {};
            part.indices.push_back(index);
            i = end + 1;
        }
        if (parts.size() == kMostKeyParts) return {};
        parts.push_back(std::move(part));
        if (i == path.size()) return parts;
        if (path[i++] != '.') return {};
    }
}

std::vector<NamedStep> named_steps(const toml::table& root) {
    std::vector<NamedStep> found;
    collect_names(root.get("step"), "step", 0, found);
    return found;
}

std::string path_by_name(const std::string& name) {
    return "step." + key_text(name);
}

std::string with_place_of_step(std::string_view path, std::span<const NamedStep> steps) {
    const std::vector<PathPart> parts = split_path(path);
    if (parts.size() < 2 || parts[0].key != "step" || !parts[0].indices.empty()) return std::string(path);
    std::vector<std::string> places, names;
    for (const NamedStep& step : steps) {
        if (step.name == parts[1].key) places.push_back(step.path);
        if (std::find(names.begin(), names.end(), step.name) == names.end()) names.push_back(step.name);
    }
    const auto shown = std::next(names.begin(), std::min<std::ptrdiff_t>(std::ssize(names), 20));
    if (places.empty() || !parts[1].indices.empty())
        throw RecipeError("no step is named {}{} {}", parts[1].key,
                          did_you_mean("; ", parts[1].key, names, ";"),
                          names.empty() ? std::string("none has a name: count from 0, e.g. step[0].duration")
                                        : fmt::format("there are {}", fmt::join(names.begin(), shown, ", ")));
    if (places.size() > 1)
        throw RecipeError("several steps are named {}: write {}, or give them names of their own",
                          parts[1].key, fmt::join(places, " or "));
    std::string placed = places.front();
    for (std::size_t p = 2; p < parts.size(); ++p) {
        placed += "." + key_text(parts[p].key);
        for (const std::size_t index : parts[p].indices) placed += fmt::format("[{}]", index);
    }
    return placed;
}

const toml::node* find_node(const toml::table& root, std::string_view path) {
    const std::vector<PathPart> parts = split_path(path);
    const toml::node* node = parts.empty() ? nullptr : &root;
    for (const PathPart& part : parts) {
        if (!node->is_table()) return nullptr;
        node = node->as_table()->get(part.key);
        for (const std::size_t index : part.indices)
            node = node != nullptr && node->is_array() ? node->as_array()->get(index) : nullptr;
        if (node == nullptr) return nullptr;
    }
    return node;
}

void apply_override(toml::table& root, const std::string& setting) {
    constexpr std::size_t kShown = 200;
    const std::string source =
        fmt::format("--set {}{}", setting.substr(0, kShown), setting.size() > kShown ? "..." : "");
    const std::size_t equals = end_of_key(setting);
    std::vector<PathPart> parts;
    try {
        if (equals != std::string::npos)
            parts = split_path(with_place_of_step(setting.substr(0, equals), named_steps(root)));
    } catch (const RecipeError& error) {
        throw RecipeError("{}: {}", source, error.what());
    }
    if (parts.empty())
        throw RecipeError(
            "{}: must be key=value, e.g. step[0].duration=2, step.etch.duration=2 of the step with that "
            "name, or flux.rays=1000",
            source);
    toml::table value = parse_value(setting.substr(equals + 1), source);

    toml::node* node = &root;
    for (std::size_t p = 0; p + 1 < parts.size(); ++p) {
        toml::node* next = child(*node, parts[p], parts[p].indices.size(), source);
        if (next == nullptr && parts[p].indices.empty()) {
            toml::table made = parse_value("{}", source);
            node->as_table()->insert_or_assign(parts[p].key, std::move(*made.get("v")->as_table()));
            next = node->as_table()->get(parts[p].key);
        }
        if (next == nullptr) throw RecipeError("{}: the recipe has no {}", source, parts[p].key);
        if (!next->is_table())
            throw RecipeError("{}: {} holds no keys in the recipe{}", source, parts[p].key,
                              next->is_array() ? "; give an index, e.g. " + parts[p].key + "[0]" : "");
        node = next;
    }

    const PathPart& last = parts.back();
    value.get("v")->visit([&](auto& v) {
        if (last.indices.empty()) {
            node->as_table()->insert_or_assign(last.key, std::move(v));
            return;
        }
        if (child(*node, last, last.indices.size(), source) == nullptr)
            throw RecipeError("{}: the recipe has no {}", source, last.key);
        toml::array* array = child(*node, last, last.indices.size() - 1, source)->as_array();
        array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(last.indices.back()), std::move(v));
    });
}

std::optional<double> written_number(const std::string& text, const std::string& file,
                                     const std::vector<std::string>& overrides, const std::string& key) {
    std::vector<std::string> notes;
    const toml::table root = recipe_tables(text, file, overrides, notes);
    const toml::node* node = find_node(root, with_place_of_step(key, named_steps(root)));
    return node == nullptr ? std::nullopt : node->value<double>();
}

}  // namespace sidewall::app
