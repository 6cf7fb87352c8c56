#pragma once
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "app/common/json.hpp"

// The data that a page of results carries, as its scripts read it.
namespace sidewall::test {

inline void write(const std::filesystem::path& path, const std::string& text) {
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
}

/// The JSON within a page.
inline std::string data_text(const std::string& html) {
    const std::string start = "id=\"data\">";
    const std::size_t begin = html.find(start) + start.size();
    return html.substr(begin, html.find("</script>", begin) - begin);
}

inline app::Json data_of(const std::string& html) {
    return app::Json::parse(data_text(html));
}

/// The first section of a type and, if given, of a title; the test fails if there is none.
inline const app::Json& section(const app::Json& data, std::string_view type, std::string_view title = "") {
    for (const app::Json& one : data["sections"])
        if (one["type"] == type && (title.empty() || one["title"] == title)) return one;
    FAIL("no section of type " << type << " " << title);
    return data;
}

}  // namespace sidewall::test
