#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace sidewall::app {

/// What a page has besides a report's style, scripts and policy.
struct PageParts {
    std::string_view style = {}, policy = {};
    std::vector<std::string_view> scripts = {};
};

/// The HTML of a page with its style, scripts and three.js inside; its policy forbids the browser to load anything.
/// \param title  escaped for HTML.
/// \param data   JSON that is safe in a script element; without `sections` the page's own scripts build it.
std::string page_html(const std::string& title, const std::string& data, const PageParts& more = {});

}  // namespace sidewall::app
