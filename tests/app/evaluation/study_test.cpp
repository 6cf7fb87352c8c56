#include "app/pictures/svg_plot.hpp"

#include <catch2/catch.hpp>
#include <set>
#include <sstream>

using namespace sidewall;
using namespace sidewall::app;

TEST_CASE("a plot shows its points, and says so when it has none") {
    const std::string svg =
        svg_plot({"a < b", "x", "y", {{"line", {{1.0, 10.0}, {2.0, 1000.0}}}}, false, true});
    CHECK(svg.find("a &lt; b") != std::string::npos);
    CHECK(svg.find("<polyline") != std::string::npos);
    CHECK(svg.find("viewBox=\"0 0 720 440\" width=\"720\"") != std::string::npos);
    // A line's name has room beside the plot: from x = 540 on, 7 pixels a letter.
    const std::string wide = svg_plot({"", "x", "y", {{std::string(60, 'm'), {{1.0, 1.0}, {2.0, 2.0}}}}});
    CHECK(wide.find("viewBox=\"0 0 960 440\" width=\"960\"") != std::string::npos);
    CHECK(svg_plot({"none", "x", "y", {{"line", {{1.0, -1.0}}}}, false, true}).find("no data") !=
          std::string::npos);
}

TEST_CASE("lines of a plot that share a colour differ by their dashes, in the legend, too") {
    Plot plot{"many", "x", "y", {}};
    for (int k = 0; k < 28; ++k) plot.series.push_back({std::to_string(k), {{1.0, 1.0 + k}, {2.0, 2.0 + k}}});
    std::istringstream svg(svg_plot(plot));
    std::multiset<std::string> lines, keys;
    for (std::string line; std::getline(svg, line);) {
        const std::size_t stroke = line.find("stroke=");
        if (line.starts_with("<polyline")) lines.insert(line.substr(stroke));
        if (line.starts_with("<line") && line.find("stroke-width=\"3\"") != std::string::npos)
            keys.insert(line.substr(stroke));
    }
    CHECK(lines.size() == 28);
    CHECK(keys.size() == 28);
    CHECK(std::set(lines.begin(), lines.end()).size() == 28);
    CHECK(std::set(keys.begin(), keys.end()).size() == 28);
}
