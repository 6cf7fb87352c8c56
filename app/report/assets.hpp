#pragma once
#include <cstddef>
#include <string>

namespace sidewall::app {

/// A page that needs no other file and asks for none: style, three.js and scripts are in it. Its policy forbids the
/// browser to load anything.
/// \param title  escaped.
/// \param data   JSON that is safe in a script element.
std::string page_html(const std::string& title, const std::string& data);

/// Bytes of a page without title and data.
std::size_t page_assets_size();

}  // namespace sidewall::app
