#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// What a page adds to the style, the scripts and the Content-Security-Policy of a report.
struct PageParts {
    std::string_view style = {}, policy = {};
    std::vector<std::string_view> scripts = {};
};

/// The HTML of a page, with style, scripts and three.js inside. Its policy forbids to load anything else.
/// \param title  escaped for HTML.
/// \param data   JSON that is safe in a script element; without `sections` scripts of \p more build it.
std::string page_html(const std::string& title, const std::string& data, const PageParts& more = {});

}  // namespace sidewall::app
