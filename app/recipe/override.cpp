#include <fmt/format.h>

#include <charconv>

#include "app/recipe/reader.hpp"
#include "app/recipe/written_number.hpp"

namespace sidewall::app {
namespace {

bool key_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

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

std::vector<PathPart> split_path(std::string_view path) {
    std::vector<PathPart> parts;
    std::size_t i = 0;
    while (true) {
        PathPart part;
        while (i < path.size() && key_character(path[i])) part.key += path[i++];
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
    const std::size_t equals = setting.find('=');
    const std::vector<PathPart> parts =
        equals == std::string::npos ? std::vector<PathPart>() : split_path(setting.substr(0, equals));
    if (parts.empty())
        throw RecipeError(
            fmt::format("{}: must be key=value, e.g. step[0].duration=2 or flux.rays=1000", source));
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
    const toml::node* node = find_node(root, key);
    return node == nullptr ? std::nullopt : node->value<double>();
}

}  // namespace sidewall::app
