#include "app/recipe/node_path.hpp"

#include <charconv>

#include "app/recipe/reader.hpp"

namespace sidewall::app {

bool key_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

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

}  // namespace sidewall::app
