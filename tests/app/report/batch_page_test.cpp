#include <catch2/catch.hpp>

#include "app/report/report.hpp"
#include "tests/app/report/page_data.hpp"
#include "tests/app/report/result_folder.hpp"

using namespace sidewall;
using namespace sidewall::app;
using sidewall::test::data_of, sidewall::test::Folder, sidewall::test::section, sidewall::test::write;

namespace {

const std::string kRecipe = R"([domain]
extent = [4.0]
grid_spacing = 0.5
length_unit = "um"
time_unit = "min"
[[layer]]
material = "Si"
[[step]]
model = "isotropic"
duration = 1.0
rate = 0.5
deposit = "SiO2"
)";

const std::string kTable =
    "run,step[0].rate,step[0].duration,depth,step_coverage_bottom,seconds,status\n"
    "0001,0.5,1,2,0.5,0.1,ok\n0002,1,1,3,0.6,0.1,ok\n0003,0.5,2,3,0.7,0.1,ok\n0004,1,2,4,0.8,0.1,ok\n";

// A fit of two keys to two figures of kTable.
Json fit_of(const std::string& more) {
    Json fit = Json::parse(R"({"vary": ["step[0].rate=0.5:1", "step[0].duration=1:2:log"], "best_run": "0002",
        "status": "converged", "errors_from": "residuals", "noise_runs": 6, "targets_met": true, "not_identifiable": [],
        "parameters": {"step[0].rate": {"value": 1.0, "unit": "um/min", "interval95": [0.9, 1.1]},
                       "step[0].duration": {"value": 1.0, "unit": "min", "interval95": [null, null]}},
        "residuals": {"depth": {"asked": 2.9, "got": 3, "sigma": null, "unit": "um", "noise": 0.05},
                      "step_coverage_bottom": {"asked": 0.6, "got": 0.6, "sigma": null, "unit": "1", "noise": 0.01}}})");
    fit.merge_patch(Json::parse(more));
    return fit;
}

Json fit_data(const std::string& more) {
    const Folder folder;
    write(folder.path / "fit.json", fit_of(more).dump());
    write(folder.path / "fit.csv", kTable);
    for (const char* run : {"0001", "0002"}) write(folder.path / "runs" / run / "recipe.toml", kRecipe);
    return data_of(make_report(folder.path).html);
}

std::vector<std::string> names(const Json& table) {
    std::vector<std::string> all;
    for (const Json& column : table["columns"]) all.push_back(column["name"]);
    return all;
}

}  // namespace

TEST_CASE("a sweep over two keys has contours, whose axes have the keys' units") {
    const Folder folder;
    write(
        folder.path / "sweep.json",
        R"({"vary": ["step[0].rate=0.5,1", "step[0].duration=1:2:log"], "rows": 4, "units": {"depth": "um"}})");
    write(folder.path / "sweep.csv", kTable);
    write(folder.path / "runs/0001/recipe.toml", kRecipe);
    const Json data = data_of(make_report(folder.path).html), &contour = section(data, "contour");
    CHECK(
        contour["keys"] ==
        Json::parse(R"([{"column": 1, "name": "step[0].rate", "label": "step[0].rate [µm/min]", "log": false},
        {"column": 2, "name": "step[0].duration", "label": "step[0].duration [min]", "log": true}])"));
    CHECK(contour["measures"][0]["label"] == "depth [\u00b5m]");
    CHECK(contour["measures"][1]["label"] == "step_coverage_bottom [1]");
    CHECK(contour["targets"].empty());
    CHECK_FALSE(contour.contains("best"));
    CHECK(section(data, "response")["keys"] == contour["keys"]);
    // A sweep over one key has no contours.
    write(folder.path / "sweep.json", R"({"vary": ["step[0].rate=0.5,1"], "rows": 4})");
    for (const Json& one : data_of(make_report(folder.path).html)["sections"])
        CHECK(one["type"] != "contour");
}

TEST_CASE("a fit of two keys has contours with the lines of its targets and its best values") {
    const Json data = fit_data("{}"), &contour = section(data, "contour");
    CHECK(contour["targets"] == Json::parse(R"([{"name": "depth", "column": 3, "value": 2.9},
        {"name": "step_coverage_bottom", "column": 4, "value": 0.6}])"));
    CHECK(contour["best"] == Json::parse("[1.0, 1.0]"));
    const Json& parameters = section(data, "intervals");
    CHECK(parameters["rows"][0]["unit"] == "\u00b5m/min");
    CHECK(
        parameters["note"] ==
        "The intervals hold the noise of the simulation, from 6 more runs with other seeds at these values.");
    CHECK(data["notes"].empty());
}

TEST_CASE("a fit without standard deviations shows none, one with them shows them") {
    const Json none = fit_data("{}"), &plain = section(none, "table", "Targets and residuals");
    CHECK(names(plain) == std::vector<std::string>{"target", "asked", "got", "residual", "noise", "unit"});
    CHECK(plain["rows"][1] == Json::parse(R"(["step_coverage_bottom", 0.6, 0.6, 0.0, 0.01, ""])"));
    const Json known = fit_data(R"({"residuals": {"depth": {"sigma": 0.2}}})"),
               &with = section(known, "table", "Targets and residuals");
    CHECK(names(with) == std::vector<std::string>{"target", "asked", "got", "residual", "noise", "sigma",
                                                  "residual / sigma", "unit"});
    CHECK(with["rows"][0] == Json::parse("[\"depth\", 2.9, 3, 0.1, 0.05, 0.2, 0.5, \"\u00b5m\"]"));
}

TEST_CASE("a fit says what its answer lacks: runs for the noise, a figure without steps, targets, keys") {
    const Json data = fit_data(R"({"noise_runs": 0, "status": "max-runs", "several_minima": true,
        "not_identifiable": [["step[0].rate", "step[0].duration"]], "residuals": {"depth": {"grid_step": 0.1}}})");
    CHECK(section(data, "intervals")["note"] ==
          "The intervals lack the noise of the simulation: too few runs were left for other seeds.");
    REQUIRE(data["notes"].size() == 4);
    CHECK(data["notes"][0].get<std::string>().starts_with("The runs did not suffice"));
    CHECK(data["notes"][1] == "There are several minima, of which this is the lowest found.");
    CHECK(
        data["notes"][2] ==
        "The targets do not tell step[0].rate from step[0].duration: only a combination of them; fix one, or add a target.");
    CHECK(data["notes"][3].get<std::string>().starts_with(
        "Runs that should differ by up to 0.1 um have the same depth to the last digit: it goes by steps of the grid"));
}

TEST_CASE("a fit that has not ended, as of an older version, has a page without results") {
    const Json data = fit_data(R"({"parameters": null, "residuals": null, "noise_runs": null})");
    CHECK(data["notes"].size() == 1);
    CHECK(section(data, "contour")["targets"].empty());
    CHECK_FALSE(section(data, "contour").contains("best"));
}

TEST_CASE("the table of steps tells what ended each and its measures, where the run took them") {
    const Folder folder;
    test::write_result_folder(folder.path);
    const auto steps = [&](const std::string& etch, const std::string& liner) {
        write(folder.path / "summary.json",
              R"({"version": "0.2.0", "time": 5.0, "time_unit": "s", "metrology": {"depth": 0.8},
            "metrology_units": {"depth": "um", "film_top": "um"}, "steps": [
            {"name": "etch", "model": "isotropic", "asked_duration": 9.0, "duration": 4.0, "stopped_by": "depth", "time_steps": 7)" +
                  etch +
                  R"(}, {"name": "liner", "model": "isotropic", "asked_duration": 1.0, "duration": 1.0,
            "stopped_by": "", "time_steps": 2)" +
                  liner + "}]}");
        return section(data_of(make_report(folder.path).html), "table", "Steps");
    };
    const Json plain = steps("", "");
    CHECK(names(plain) ==
          std::vector<std::string>{"step", "model", "asked [s]", "took [s]", "ended by", "time steps"});
    CHECK(plain["rows"][0] == Json::parse(R"(["etch", "isotropic", 9.0, 4.0, "depth", 7])"));
    const Json measured = steps(R"(, "measures": {"depth": 0.9}, "bare": 0.95)",
                                R"(, "measures": {"depth": 0.8, "film_top": null})");
    CHECK(names(measured) == std::vector<std::string>{"step", "model", "asked [s]", "took [s]", "ended by",
                                                      "time steps", "bare share", "depth [\u00b5m]",
                                                      "film_top [\u00b5m]"});
    CHECK(measured["rows"][0] ==
          Json::parse(R"(["etch", "isotropic", 9.0, 4.0, "depth", 7, 0.95, 0.9, null])"));
    CHECK(measured["rows"][1] == Json::parse(R"(["liner", "isotropic", 1.0, 1.0, "", 2, null, 0.8, null])"));
    const Json ended = steps(R"(, "endpoint": {"time": 3.5, "bare": null, "over_etch": 0.5})", "");
    CHECK(names(ended) == std::vector<std::string>{"step", "model", "asked [s]", "took [s]", "ended by",
                                                   "time steps", "endpoint [s]", "over-etch [s]"});
    CHECK(ended["rows"][0] == Json::parse(R"(["etch", "isotropic", 9.0, 4.0, "depth", 7, 3.5, 0.5])"));
    CHECK(ended["rows"][1] == Json::parse(R"(["liner", "isotropic", 1.0, 1.0, "", 2, null, null])"));
}

TEST_CASE(
    "charts over time name every step where it begins, and those that take no time with the one after") {
    const Folder folder;
    test::write_result_folder(folder.path);
    write(
        folder.path / "timeline.csv",
        "step,name,time [s],relative_error,depth [um],step_coverage_bottom\n1,etch,0,0.01,0,1\n1,etch,2.5,0.01,1,1\n"
        "2,strip,2.5,0,1,1\n3,liner,2.5,0.01,1,1\n3,liner,5,0.01,0.9,1\n");
    const Json data = data_of(make_report(folder.path).html);
    const Json& charts = section(data, "charts", "Measures over time")["charts"];
    CHECK(charts[0]["marks"] == Json::parse(R"([[0, "etch"], [2.5, "strip, liner"]])"));
    CHECK(charts[0]["x"] == "time [s]");
    CHECK(charts[1]["y"] == "step coverage [1]");
    for (const Json& one : data["sections"])
        if (one["type"] == "charts")
            for (const Json& chart : one["charts"]) {
                CHECK_THAT(chart["x"].get<std::string>(), Catch::Contains(" ["));
                CHECK_THAT(chart["y"].get<std::string>(), Catch::Contains(" ["));
            }
}
