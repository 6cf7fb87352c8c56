#include "app/report/assets.hpp"

#include <fmt/format.h>

#include "app/report/embed.hpp"

SIDEWALL_EMBED(three, SIDEWALL_THREE_JS);
SIDEWALL_EMBED(orbit, SIDEWALL_ORBIT_CONTROLS_JS);
SIDEWALL_EMBED(style, SIDEWALL_REPORT_DIR "/page.css");
SIDEWALL_EMBED(charts, SIDEWALL_REPORT_DIR "/charts.js");
SIDEWALL_EMBED(tables, SIDEWALL_REPORT_DIR "/tables.js");
SIDEWALL_EMBED(contours, SIDEWALL_REPORT_DIR "/contours.js");
SIDEWALL_EMBED(solid, SIDEWALL_REPORT_DIR "/solid.js");
SIDEWALL_EMBED(viewer, SIDEWALL_REPORT_DIR "/viewer.js");
SIDEWALL_EMBED(panel, SIDEWALL_REPORT_DIR "/panel.js");
SIDEWALL_EMBED(page, SIDEWALL_REPORT_DIR "/page.js");

namespace sidewall::app {
namespace {

// The notice that the licence of three.js and its orbit controls asks copies to carry.
constexpr std::string_view kThreeLicence = R"(/*! three.js r111, https://threejs.org, under the MIT License:
Copyright (c) 2010-2019 three.js authors
Permission is hereby granted, free of charge, to any person obtaining a copy of this software and associated
documentation files (the "Software"), to deal in the Software without restriction, including without limitation the
rights to use, copy, modify, merge, publish, distribute, sublicense, and/or sell copies of the Software, and to permit
persons to whom the Software is furnished to do so, subject to the following conditions: The above copyright notice and
this permission notice shall be included in all copies or substantial portions of the Software. THE SOFTWARE IS PROVIDED
"AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF
MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT
HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING
FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE. */
)";

constexpr std::string_view kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:";

}  // namespace

std::string page_html(const std::string& title, const std::string& data, const PageParts& more) {
    std::string html = fmt::format(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
        "<meta http-equiv=\"Content-Security-Policy\" content=\"{}{}\">\n"
        "<meta name=\"referrer\" content=\"no-referrer\">\n<link rel=\"icon\" href=\"data:,\">\n"
        "<title>{}</title>\n<style>\n{}{}</style>\n</head>\n<body>\n"
        "<noscript>This page draws its charts and tables with its own script: allow scripts for this file.</noscript>\n"
        "<main id=\"page\"></main>\n<script type=\"application/json\" id=\"data\">",
        kPolicy, more.policy, title, embedded_style, more.style);
    html += data;
    html += "</script>\n";
    html += fmt::format("<script>\n{}{}\n{}</script>\n", kThreeLicence, embedded_three, embedded_orbit);
    for (const std::string_view text : {embedded_charts, embedded_tables, embedded_contours, embedded_solid,
                                        embedded_viewer, embedded_panel, embedded_page})
        html += fmt::format("<script>\n{}</script>\n", text);
    for (const std::string_view text : more.scripts) html += fmt::format("<script>\n{}</script>\n", text);
    return html + "</body>\n</html>\n";
}

}  // namespace sidewall::app
