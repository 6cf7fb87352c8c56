#pragma once
#include <string>

#include "app/common/json_fwd.hpp"

// What a study found, from its study.json.
namespace sidewall::app {

/// The verdict on each of the chapter's claims, and the table of the five ways, in Markdown.
std::string study_report(const Json& study);

/// Distances and times as comma separated values, a row a method and share of vertices removed.
std::string study_csv(const Json& study);

}  // namespace sidewall::app
