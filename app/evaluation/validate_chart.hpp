#pragma once
#include <string>

#include "app/common/json_fwd.hpp"
#include "app/fit/fit_profile.hpp"

// Charts of validation cases: as JSON, which app/report/charts.js draws, and as SVG pictures for Markdown.
namespace sidewall::app {

/// Chart of a run's profile over a measured one, cut to a box around the measured one.
Json chart_of_profile(const Contour& ours, const MeasuredProfile& reference, const std::string& length_unit);

/// Chart of our figures, the references and their bars over the readings' "x". If one has no "x", all are
/// divided by their references and drawn over the row's number. \param x_axis  label of the x axis.
Json chart_of_figures(const Json& readings, const std::string& x_axis);

/// A chart as an SVG picture.
std::string chart_svg(const Json& chart);

}  // namespace sidewall::app
