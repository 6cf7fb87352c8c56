#pragma once
#include <string>

namespace sidewall::app {

/// The workbench's page: the scripts and the style of reports, an editor, and its own script.
std::string workbench_html();

}  // namespace sidewall::app
