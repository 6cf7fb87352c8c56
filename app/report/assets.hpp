#pragma once
#include <string>

namespace sidewall::app {

/// The HTML of a page with its style, scripts and three.js inside; its policy forbids the browser to load anything.
/// \param title  escaped for HTML.
/// \param data   JSON that is safe in a script element.
std::string page_html(const std::string& title, const std::string& data);

}  // namespace sidewall::app
