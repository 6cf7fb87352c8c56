#include <algorithm>
#include <string>

#include "app/recipe/reader.hpp"

namespace sidewall::app {
namespace {

// Past the end of the string or comment that begins at \p i; \p i itself if none does.
std::size_t past_quoted(std::string_view text, std::size_t i) {
    const char c = text[i];
    if (c == '#') return std::min(text.find('\n', i), text.size());
    if (c != '"' && c != '\'') return i;
    const bool several_lines = text.substr(i, 3) == std::string(3, c);
    const std::string end(several_lines ? 3 : 1, c);
    for (std::size_t k = i + end.size(); k < text.size(); ++k) {
        if (c == '"' && text[k] == '\\')
            ++k;
        else if (text.substr(k, end.size()) == end)
            return k + end.size();
        else if (!several_lines && text[k] == '\n')
            return k;  // not TOML: the parser says so
    }
    return text.size();
}

}  // namespace

std::size_t line_of_deep_key(std::string_view text) {
    std::size_t line = 1, dots = 0;
    for (std::size_t i = 0; i < text.size();) {
        if (const std::size_t end = past_quoted(text, i); end > i) {
            line +=
                static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                                    text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
            i = end;
            continue;
        }
        const char c = text[i++];
        if (c == '.' && ++dots >= kMostKeyParts) return line;
        if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) dots = 0;
        line += c == '\n';
    }
    return 0;
}

}  // namespace sidewall::app
