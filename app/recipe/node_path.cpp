#include "app/recipe/node_path.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "app/recipe/reader.hpp"

namespace sidewall::app {
namespace {

bool is_bare(std::string_view key) {
    return !key.empty() && std::all_of(key.begin(), key.end(), key_character);
}

// Steps that nest deeper than a recipe may are left to the reader to refuse.
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

}  // namespace

bool key_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

std::vector<PathPart> split_path(std::string_view path) {
    std::vector<PathPart> parts;
    std::size_t i = 0;
    while (true) {
        PathPart part;
        if (i < path.size() && (path[i] == '"' || path[i] == '\'')) {
            const std::size_t end = path.find(path[i], i + 1);
            if (end == std::string_view::npos) return {};
            part.key = path.substr(i + 1, end - i - 1);
            i = end + 1;
        } else {
            while (i < path.size() && key_character(path[i])) part.key += path[i++];
        }
        if (part.key.empty()) return {};
        while (i < path.size() && path[i] == '[') {
            const std::size_t end = path.find(']', i);
            if (end == std::string_view::npos) return {};
            std::size_t index = 0;
            const auto [stop, error] = std::from_chars(path.data() + i + 1, path.data() + end, index);
            if (error != std::errc() || stop != path.data() + end) return {};
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
    if (is_bare(name)) return "step." + name;
    const char quote = name.find('"') == std::string::npos ? '"' : '\'';
    return fmt::format("step.{}{}{}", quote, name, quote);
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
        throw RecipeError(fmt::format(
            "no step is named {}{} {}", parts[1].key, did_you_mean("; ", parts[1].key, names, ";"),
            names.empty() ? std::string("none has a name: count from 0, e.g. step[0].duration")
                          : fmt::format("there are {}", fmt::join(names.begin(), shown, ", "))));
    if (places.size() > 1)
        throw RecipeError(fmt::format("several steps are named {}: write {}, or give them names of their own",
                                      parts[1].key, fmt::join(places, " or ")));
    std::string placed = places.front();
    for (std::size_t p = 2; p < parts.size(); ++p) {
        placed += "." + (is_bare(parts[p].key) ? parts[p].key : toml_text(parts[p].key));
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

}  // namespace sidewall::app
