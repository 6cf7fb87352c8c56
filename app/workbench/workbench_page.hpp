#pragma once
#include <string>

namespace sidewall::app {

/// The HTML of the workbench: scripts and style of reports, an editor, and the scripts of the workbench.
std::string workbench_html();

}  // namespace sidewall::app
