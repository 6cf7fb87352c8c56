#pragma once
#include <string>

#include "app/common/json_fwd.hpp"
#include "app/fit/fit_profile.hpp"

// Charts of validate's cases: as JSON, which pages of reports draw (app/report/charts.js), and as pictures
// for Markdown.
namespace sidewall::app {

/// A run's profile over a measured one, as far as that reaches.
Json chart_of_profile(const Contour& ours, const MeasuredProfile& reference, const std::string& length_unit);

/// Ours, the reference and its bars over the readings' "x"; where one has none, over the reference by the row's number.
/// \param x_axis  what x is.
Json chart_of_figures(const Json& readings, const std::string& x_axis);

/// A chart as an SVG picture.
std::string chart_svg(const Json& chart);

}  // namespace sidewall::app
