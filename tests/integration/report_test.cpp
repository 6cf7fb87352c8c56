#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "tests/integration/run_program.hpp"

// Result pages in a browser, where report_selftest.js checks them.
namespace {

using sidewall::test::config;
using sidewall::test::Folder;
using sidewall::test::Outcome;
using sidewall::test::run_command;
using sidewall::test::run_program;

using Json = nlohmann::ordered_json;

const std::string kBrowser =
    "chromium --headless --no-sandbox --disable-dev-shm-usage --user-data-dir=profile ";

const std::string kScript = SIDEWALL_SOURCE_DIR "/tests/integration/report_selftest.js";

bool has_browser() {
    const Folder folder;
    const auto succeeds = [&](const std::string& command) {
        return run_command(folder.path, command + " >/dev/null 2>&1").exit_code == 0;
    };
    if (!succeeds("command -v chromium"))
        WARN("skipped: chromium is not installed");
    else if (!succeeds("timeout -k 1 120 " + kBrowser + "--dump-dom about:blank"))
        WARN("skipped: chromium does not start here");
    else
        return true;
    return false;
}

// What report_selftest.js finds on a page.
Json selftest(const Folder& folder, const std::string& page, const std::string& options) {
    std::string html = sidewall::test::read_bytes(folder.path / page);
    html.insert(html.find("<main"), "<script>" + sidewall::test::read_bytes(kScript) + "</script>");
    std::ofstream(folder.path / "tested.html", std::ios::binary) << html;
    const Outcome outcome = run_command(
        folder.path, "timeout -k 1 300 " + kBrowser + "--virtual-time-budget=200000 --dump-dom " + options +
                         " 'file://" + (folder.path / "tested.html").string() + "' 2>browser.log");
    const std::string start = "<pre id=\"selftest\" hidden=\"\">";
    const std::size_t begin = outcome.output.find(start);
    INFO(sidewall::test::read_bytes(folder.path / "browser.log"));
    REQUIRE(begin != std::string::npos);
    std::string text = outcome.output.substr(begin + start.size());
    text.resize(text.find("</pre>"));
    for (const auto& [coded, plain] : {std::pair("&lt;", "<"), {"&gt;", ">"}, {"&amp;", "&"}})
        for (std::size_t at = 0; (at = text.find(coded, at)) != std::string::npos; ++at)
            text.replace(at, std::string(coded).size(), plain);
    return Json::parse(text);
}

void run_and_report(const Folder& folder) {
    const std::string depths = "[-1,-0.8,-0.6,-0.4,-0.2,0.1,0.2,0.3,0.4,0.5]";  // lines of one chart
    const Outcome run = run_program(
        folder.path,
        "run " + config("quick/sf6o2_hole.toml") + " --set metrology.cd_depths=" + depths + " -o run --quiet",
        60);
    INFO(run.output);
    REQUIRE(run.exit_code == 0);
    const Outcome report = run_program(folder.path, "report run -o page.html");
    INFO(report.output);
    REQUIRE(report.exit_code == 0);
}

const std::string kDrawing = "--use-angle=swiftshader --enable-unsafe-swiftshader --window-size=900,700";

}  // namespace

TEST_CASE("a page draws its surfaces in the legend's colours, and slider, keys and cut change the picture",
          "[slow]") {
    if (!has_browser()) return;
    const Folder folder;
    run_and_report(folder);
    const Json page = selftest(folder, "page.html", kDrawing);
    INFO(page.dump(2));
    CHECK(page["errors"].empty());
    CHECK(page["requests"] == 0);
    CHECK(page["not_numbers"] == 0);
    REQUIRE(page["webgl"] == true);
    CHECK(page["colours"] > 50);  // of a lit surface; a blank canvas has one
    CHECK(page["frames"] == 3);
    for (const char* law : {"slider_changes_picture", "slider_returns_picture", "key_turns_picture",
                            "drag_turns_picture", "reset_returns_picture", "cut_changes_picture"})
        CHECK(page[law] == true);
    // Materials, rate, fluxes and coverages. One place in 50 may lie on an edge that the grid of places
    // misses.
    CHECK(page["legend"].size() >= 6);
    for (const auto& [name, places] : page["legend"].items()) {
        CAPTURE(name);
        const int tried = places["tried"], same = places["same"];
        CHECK(tried - places["faces"].get<int>() >= 10);
        if (name == "material") CHECK(places["faces"].get<int>() >= 10);
        CHECK(50 * (tried - same) <= tried);
    }
    CHECK(page["charts"] >= 6);
    CHECK(page["most_lines"] == 10);
    CHECK(page["same_lines"] == 0);
    CHECK(page["sorts"][0] < page["sorts"][1]);
    CHECK(page["width"][0] <= page["width"][1]);

    const Json phone = selftest(folder, "page.html", kDrawing + " --window-size=500,800");
    CHECK(phone["errors"].empty());
    CHECK(phone["width"][0] <= phone["width"][1]);  // nothing reaches beyond the screen
}

TEST_CASE(
    "pages of a sweep, a fit, a comparison and a study have their sections and no error, on a small screen too",
    "[slow]") {
    if (!has_browser()) return;
    const Folder folder;
    const std::string recipe = config("quick/trench_deposition.toml") + " --set step[0].duration=0.2 ",
                      quiet = " --quiet >/dev/null";
    const auto make = [&](const std::string& command) {
        const Outcome outcome = run_program(folder.path, command, 300);
        INFO(command << "\n" << outcome.output);
        REQUIRE(outcome.exit_code == 0);
    };
    make("sweep " + recipe + "-o sweep --vary step[0].sticking=0.1:1:3:log --vary step[0].rate=0.5,1" +
         quiet);
    make("fit " + recipe +
         "-o fit --vary step[0].sticking=0.05:1:log --vary step[0].rate=0.5:2:log "
         "--target film_top=0.2 --target film_side=0.12" +
         quiet);
    make("compare " + recipe + "-o compare >/dev/null");
    std::ofstream(folder.path / "surface1.toml")
        << "domain = {extent = [4.0, 4.0], grid_spacing = 0.25}\n"
           "layer = [{material = \"Si\", shape = \"fin\", width = 2.0, height = 1.0}]\n"
           "step = [{model = \"isotropic\", duration = 0.3, rate = 1.0, deposit = \"SiO2\"}]\n"
           "simplify = {method = \"none\"}\n";
    make("study --quick --surface 1 --rays 20000 --recipes . -o study >/dev/null");
    for (const auto& [kind, sections, charts] :
         std::vector<std::tuple<std::string, std::vector<std::string>, int>>{
             {"sweep", {"view", "response", "matrix", "table"}, 5},
             {"fit", {"view", "intervals", "correlation", "response", "table"}, 1},
             {"compare", {"table", "bars"}, 1},
             {"study", {"markdown", "charts", "table"}, 5}}) {
        make("report " + kind + " -o " + kind + ".html");
        for (const char* size : {"", " --window-size=500,800"}) {
            const Json page = selftest(folder, kind + ".html", kDrawing + size);
            INFO(kind << size << "\n" << page.dump(2));
            CHECK(page["errors"].empty());
            CHECK(page["requests"] == 0);
            CHECK(page["not_numbers"] == 0);
            CHECK(page["charts"] >= charts);
            CHECK(page["same_lines"] == 0);
            CHECK(page["width"][0] <= page["width"][1]);
            for (const std::string& section : sections)
                CHECK(std::count(page["sections"].begin(), page["sections"].end(), section) >= 1);
        }
        CHECK(std::filesystem::file_size(folder.path / (kind + ".html")) < 6'000'000);
    }
}

TEST_CASE("a browser without WebGL shows the page's charts and tables", "[slow]") {
    if (!has_browser()) return;
    const Folder folder;
    run_and_report(folder);
    const Json page = selftest(folder, "page.html", "--disable-gpu --disable-3d-apis");
    INFO(page.dump(2));
    CHECK(page["webgl"] == false);
    CHECK(page["errors"].empty());
    CHECK(page["charts"] >= 6);
    CHECK(page["not_numbers"] == 0);
}

TEST_CASE("report refuses what it cannot read or write, and names it") {
    const Folder folder;
    const Outcome none = run_program(folder.path, "report nowhere -o page.html");
    CHECK(none.exit_code == 3);
    CHECK(none.output.find("nowhere: no such folder") != std::string::npos);
    const Outcome name = run_program(folder.path, "report . -o page.png");
    CHECK(name.exit_code == 2);
    CHECK(name.output.find("must end in .html") != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(folder.path / "page.html"));
}
