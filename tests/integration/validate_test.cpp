#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "app/evaluation/validate_cases.hpp"
#include "surface/error.hpp"
#include "tests/integration/run_program.hpp"

using namespace sidewall;

namespace {

std::vector<app::ValidationCase> shipped() {
    return app::validation_cases(SIDEWALL_SOURCE_DIR "/configs/validation");
}

// A folder with one case, a copy of a shipped one.
struct OneCase {
    test::Folder folder;
    std::filesystem::path recipe, table;

    explicit OneCase(const std::string& name) {
        const std::filesystem::path mine = folder.path / "cases" / "mine";
        std::filesystem::create_directories(mine.parent_path());
        std::filesystem::copy(SIDEWALL_SOURCE_DIR "/configs/validation/" + name, mine);
        recipe = mine / "recipe.toml";
        table = mine / "reference.csv";
    }
    test::Outcome validate(const std::string& more = "") const {
        return test::run_program(folder.path, "validate --cases cases -o out" + more, 120);
    }
};

}  // namespace

TEST_CASE(
    "every case of validate has a source, figures and a recipe that is good on twice the spacing, too") {
    std::set<std::string> names;
    for (const app::ValidationCase& one : shipped()) {
        INFO(one.name);
        CHECK(names.insert(one.name).second);
        CHECK_FALSE(one.source.empty());
        CHECK_FALSE(one.figures.empty());
        for (const std::vector<std::size_t>& rows : app::case_runs(one)) {
            const app::Recipe recipe = app::case_recipe(one, rows);
            CHECK_NOTHROW(app::case_recipe(
                one, rows, {"domain.grid_spacing=" + std::to_string(2.0 * recipe.domain.grid_spacing)}));
        }
    }
    CHECK(names.size() >= 20);
}

TEST_CASE("the guide's page of validation has every case, and no other") {
    const std::string page = test::read_bytes(SIDEWALL_SOURCE_DIR "/docs/validation.md");
    std::size_t headings = 0;
    for (std::size_t at = page.find("\n## "); at != std::string::npos; at = page.find("\n## ", at + 1))
        ++headings;
    const std::vector<app::ValidationCase> cases = shipped();
    CHECK(headings == cases.size() + 1);  // one more for the cases left out
    for (const app::ValidationCase& one : cases) {
        INFO(one.name);
        CHECK(page.find("\n## " + one.name + "\n") != std::string::npos);
    }
    // Every figure outside of its bars is explained.
    CHECK(page.find("Not explained.") == std::string::npos);
}

TEST_CASE("validate runs a case on two grids and tells what it finds, with source and bars") {
    const test::Folder folder;
    const auto outcome = test::run_program(folder.path, "validate --case even_film -o out --json -", 120);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const auto found = nlohmann::json::parse(outcome.output);
    REQUIRE(found["cases"].size() == 1);
    const auto& one = found["cases"][0];
    CHECK(one["name"] == "even_film");
    CHECK_FALSE(one["source"].get<std::string>().empty());
    REQUIRE(one["readings"].size() == 3);
    const double dx = one["grid_spacing"].get<double>();
    // Flats lie within a tenth of a grid spacing; an opening has two walls.
    CHECK(std::abs(one["readings"][0]["deviation"].get<double>()) < 0.1 * dx);
    CHECK(std::abs(one["readings"][1]["deviation"].get<double>()) < 0.2 * dx);
    for (const auto& reading : one["readings"]) {
        const double bars = reading["noise"].get<double>() + reading["grid"].get<double>() +
                            reading["reference_bar"].get<double>();
        const double deviation = std::abs(reading["deviation"].get<double>());
        // The bars are printed to two digits.
        if (std::abs(deviation - bars) > 0.05 * bars) CHECK(reading["within_bars"] == (deviation <= bars));
    }
    CHECK(std::filesystem::exists(folder.path / "out" / "validation.md"));
    CHECK(nlohmann::json::parse(test::read_bytes(folder.path / "out" / "validation.json")) == found);
}

TEST_CASE("validate goes on where it was killed, and a part of the cases keeps the rows of the others") {
    const test::Folder folder;
    const auto run = [&](const std::string& arguments) {
        const auto outcome = test::run_program(folder.path, "validate -o out --json - " + arguments, 120);
        INFO(outcome.output);
        CHECK(outcome.exit_code == 0);
        return nlohmann::json::parse(outcome.output);
    };
    // Killed once the case itself is run and the next one has begun.
    test::run_command(
        folder.path,
        "true; '" SIDEWALL_PROGRAM
        "' validate -o out --case even_film </dev/null >log 2>&1 & p=$!; until "
        "[ -e out/even_film/summary.json ]; do sleep 0.02; done; kill -9 $p; wait $p 2>/dev/null");
    const auto bytes = [&] { return test::read_bytes(folder.path / "out/even_film/summary.json"); };
    const std::string before = bytes();
    const auto resumed = run("--case even_film --resume");
    CHECK(bytes() == before);  // a new run would change its seconds
    CHECK(run("--case even_film --resume") == resumed);
    // The row of another case, as a run of all would have left it.
    auto report = resumed;
    const std::vector<app::ValidationCase> cases = shipped();
    const app::ValidationCase& other = cases.front();
    REQUIRE(other.name != "even_film");
    auto row = resumed["cases"][0];
    row["name"] = other.name;
    row["recipe"] = other.recipe;
    row["table"] = other.table;
    row["readings"] = nlohmann::json::array();
    for (std::size_t k = 0; k < other.figures.size(); ++k)
        row["readings"].push_back(resumed["cases"][0]["readings"][0]);
    auto stale = row;  // of a recipe that the program does not have
    stale["name"] = cases[1].name;
    report["cases"] = {stale, row};
    std::ofstream(folder.path / "out/validation.json") << report;
    const auto both = run("--case even_film --resume");
    REQUIRE(both["cases"].size() == 2);
    CHECK(both["cases"][0] == row);
    CHECK(both["cases"][1] == resumed["cases"][0]);
    CHECK(test::read_bytes(folder.path / "out/validation.md").find("\n## " + other.name + "\n") !=
          std::string::npos);
}

TEST_CASE("a deviation has the sign of ours less the reference, and a grid error is unknown on one grid") {
    const OneCase one("even_film");
    test::write_bytes(one.recipe, R"([domain]
extent = [1.0, 1.0]
grid_spacing = 0.1
[[layer]]
material = "Si"
[[step]]
model = "single_particle"
duration = 0.1
rate = -1.0
sticking = 1.0
[flux]
rays = 1000
[simplify]
method = "none"
)");
    // On twice the spacing no triangle's centroid is that near to the axis.
    test::write_bytes(one.table,
                      "# title: t\n# source: s\nfigure,label,unit,reference,bar,per,radius\n"
                      "depth,negative,um,-0.08,0,-1,\nflux_neutral,one grid,1,1,0.5,,0.06\n");
    const test::Outcome outcome = one.validate(" --json -");
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const auto readings = nlohmann::json::parse(outcome.output)["cases"][0]["readings"];
    const double deviation = readings[0]["deviation"];
    CHECK(deviation < 0.0);
    CHECK(readings[0]["deviation_percent"].get<double>() == Approx(100.0 * deviation / 0.08).epsilon(0.01));
    CHECK(readings[1]["ours"].get<double>() > 0.5);
    CHECK(readings[1]["grid"].is_null());
    CHECK(readings[1]["within_bars"] == true);
    CHECK_THAT(test::read_bytes(one.folder.path / "out" / "validation.md"),
               Catch::Contains("| one grid | ") && Catch::Contains(" | unknown | 1 +- 0.5 |"));
}

TEST_CASE("a case that validate does not know is refused by its name") {
    const test::Folder folder;
    const auto outcome = test::run_program(folder.path, "validate --case koh_pitt");
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.output.find("did you mean koh_pit") != std::string::npos);
}

TEST_CASE("a folder is a case: figures that its recipe does not ask for, a profile, and no C++") {
    const OneCase one("even_film");
    std::string table = test::read_bytes(one.table);
    std::string recipe = test::read_bytes(one.recipe);
    const std::size_t metrology = recipe.find("[metrology]");
    REQUIRE(metrology != std::string::npos);
    test::write_bytes(one.recipe, recipe.substr(0, metrology));
    // The exact offset's walls, and its floor a hundredth too low.
    test::write_bytes(one.table.parent_path() / "walls.csv", "x,z\n-0.5,-5\n0.5,-5\n0.5,-4\n");
    test::write_bytes(one.table.parent_path() / "floor.csv", "x,z\n-0.2,-8.51\n0,-8.51\n0.2,-8.51\n");
    test::write_bytes(one.table,
                      table + "walls.csv,walls,um,0,0,,\nfloor.csv,\"floor, too low\",um,0.01,0,,\n");
    const test::Outcome outcome = one.validate(" --json -");
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const auto found = nlohmann::json::parse(outcome.output)["cases"][0];
    CHECK(found["name"] == "mine");
    REQUIRE(found["readings"].size() == 5);
    CHECK(found["chart"]["same_scale"] == true);  // the run's walls and the three points
    CHECK(found["chart"]["series"][0]["points"].size() > 3);
    CHECK(found["chart"]["series"][1]["points"].size() == 3);
    const double dx = found["grid_spacing"].get<double>();
    CHECK(std::abs(found["readings"][1]["deviation"].get<double>()) < 0.2 * dx);
    CHECK(found["readings"][3]["ours"].get<double>() < 0.1 * dx);
    CHECK(std::abs(found["readings"][4]["deviation"].get<double>()) < 0.1 * dx);
    CHECK(found["readings"][4]["label"] == "floor, too low");
}

TEST_CASE(
    "rows set keys and share runs, fitted ones are not counted, and charts, report and history have every figure") {
    const OneCase one("even_film");
    test::write_bytes(one.table,
                      "# title: t\n# source: s\n# fitted: nothing but for show\n# x: rate\n"
                      "figure,label,unit,reference,bar,x,role,per,set:step[0].rate,set:step[0].duration,why\n"
                      "depth,\"a, whole\",um,8.5,0.05,1,fitted,1,,,\n"
                      "depth,half,um,4.625,0.05,2,held out,2,0.5,,Nothing is outside here.\n"
                      "cd_at_5,walls of half,um,2.5,0.05,3,same number,1,0.5,,\n"
                      "depth,wrong,um,8.5,0,4,,1,0.5,1.0,\"It is so, in a test.\"\n"
                      "depth,wrong again,um,8.4,0,5,,1,0.5,1.0,\"It is so, in a test.\"\n"
                      "depth,unknown,um,8.3,0,6,,1,0.5,1.0,\n");
    const std::string rest = "0.1.0,mine,depth,um,7,8,no\n";
    test::write_bytes(one.folder.path / "history.csv",
                      "version,case,figure,unit,ours,reference,within\n" + rest);
    for (int again = 0; again < 2; ++again) {
        const test::Outcome outcome = one.validate(" --json - --resume --history history.csv");
        INFO(outcome.output);
        REQUIRE(outcome.exit_code == 0);
        const auto found = nlohmann::json::parse(outcome.output)["cases"][0];
        REQUIRE(found["readings"].size() == 6);
        const double expected[] = {8.5, 4.625, 2.5, 9.5,
                                   9.5, 9.5};  // the floor is at 10, less the film; halved in the second row
        for (std::size_t k = 0; k < 6; ++k)
            CHECK(found["readings"][k]["ours"].get<double>() == Approx(expected[k]).margin(0.03));
        CHECK(found["readings"][0]["role"] == "fitted");
        CHECK(found["chart"]["series"][0]["points"].size() == 6);
        CHECK(found["chart"]["x"] == "rate");
    }
    // A run for each of the three settings, on the two grids.
    for (const char* run : {"mine", "mine-coarse", "mine-2", "mine-2-coarse", "mine-3", "mine-3-coarse"})
        CHECK(std::filesystem::exists(one.folder.path / "out" / run / "summary.json"));
    CHECK_FALSE(std::filesystem::exists(one.folder.path / "out" / "mine-4"));
    const std::string page = test::read_bytes(one.folder.path / "out/validation.md");
    CHECK(
        page.find(
            "Of 4 figures of 1 cases 1 lie within. 1 more were fitted and are not counted. 1 more are the same number") !=
        std::string::npos);
    CHECK(page.find(
              "\n\nOutside: wrong; wrong again. It is so, in a test.\n\nOutside: unknown. Not explained.\n\n"
              "Reference: ") != std::string::npos);
    CHECK(page.find("Nothing is outside here.") == std::string::npos);
    CHECK(page.find("| yes, held out |") != std::string::npos);
    CHECK(page.find("| yes, same number |") != std::string::npos);
    CHECK(page.find("| fitted |") != std::string::npos);
    CHECK(page.find("Fitted: nothing but for show.") != std::string::npos);
    CHECK(page.find("![mine](validation/mine.svg)") != std::string::npos);
    const std::string picture = test::read_bytes(one.folder.path / "out/validation/mine.svg");
    CHECK(picture.starts_with("<svg xmlns="));
    std::size_t circles = 0;
    for (std::size_t at = picture.find("<circle"); at != std::string::npos;
         at = picture.find("<circle", at + 1))
        ++circles;
    CHECK(circles == 12);  // ours and the reference
    const std::string history = test::read_bytes(one.folder.path / "history.csv");
    CHECK(history.find(rest) != std::string::npos);
    CHECK(history.find(",mine,\"a, whole\",um,8.5") != std::string::npos);
    CHECK(std::count(history.begin(), history.end(), '\n') == 8);  // no row twice
    // A file that is no history is refused and stays unchanged.
    test::write_bytes(one.folder.path / "mine.csv", "a,b\n1,2\n");
    CHECK(one.validate(" --resume --history mine.csv").exit_code != 0);
    CHECK(test::read_bytes(one.folder.path / "mine.csv") == "a,b\n1,2\n");
    const test::Outcome report = test::run_program(one.folder.path, "report out -o out.html", 60);
    INFO(report.output);
    CHECK(report.exit_code == 0);
    CHECK(test::read_bytes(one.folder.path / "out.html").find("\"kind\":\"validation\"") !=
          std::string::npos);
}

TEST_CASE("a broken case is refused by file and line before anything is run") {
    const std::string head = "# title: t\n# source: s\n", names = "figure,label,unit,reference,bar";
    for (
        const auto& [table, message] : std::vector<std::pair<std::string, std::string>>{
            {head + names + "\ndepth,a,um,8.5\n",
             "reference.csv:4: 4 values under 5 names: put a value with commas in quotes"},
            {head + names + "\ndepth,a,um,deep,0\n",
             "reference.csv:4: \"deep\" under reference is not a finite number"},
            {head + names + "\ndepth,a,um,8.5,\n",
             "reference.csv:4: a row needs values under figure, label, unit, reference and bar"},
            {head + "figure,label,unit,reference,bars\n",
             "reference.csv:3: column \"bars\": there is none: did you mean bar?"},
            {head + names + "\ndepht,a,um,8.5,0\n",
             "reference.csv:4: figure depht: no run measures that: did you mean depth?"},
            {head + names + "\nfilm,a,um,8.5,0\n",
             "reference.csv:4: figure film: film stands for several figures: name one, e.g. film_side"},
            {head + names + "\nflux_neutral,a,1,1,0\n",
             "reference.csv:4: figure \"flux_neutral\": there is none"},
            {head + names + "\nwalls.csv,a,um,0,0\n", "walls.csv: "},
            {head + names + ",role\ndepth,a,um,8.5,0,held\n",
             "reference.csv:4: role \"held\": there is none; there are fitted, held out"},
            {head + names + ",role\ndepth,a,um,8.5,0,fitted\n",
             "reference.csv: a line \"# fitted: which parameter, to which rows\" and rows of the role \"fitted\" go "
             "together"},
            {head + "# fitted: rate\n" + names + "\ndepth,a,um,8.5,0\n",
             "rows of the role \"fitted\" go together"},
            {head + names + ",per\ndepth,a,um,8.5,0,0\n", "reference.csv:4: per is 0"},
            {head + names + ",x\ndepth,a,um,8.5,0,deep\n",
             "reference.csv:4: \"deep\" under x is not a finite number"},
            {head + names + ",set:step[0].rates\ndepth,a,um,8.5,0,2.0\n", "step[0].rates"},
            {"# title: t\n" + names + "\ndepth,a,um,8.5,0\n",
             "reference.csv: needs lines \"# title: ...\" and \"# source: ...\""},
            {head + "# order: first\n", "reference.csv:3: order must be a number"}}) {
        const OneCase one("even_film");
        test::write_bytes(one.table, table);
        const test::Outcome outcome = one.validate();
        INFO(message << "\n" << outcome.output);
        CHECK((outcome.exit_code == 2 || outcome.exit_code == 3));
        CHECK(outcome.output.find(message) != std::string::npos);
        CHECK_FALSE(std::filesystem::exists(one.folder.path / "out"));
    }
    const OneCase flux("trench_view");
    std::string table = test::read_bytes(flux.table);
    table.replace(table.find(",floor,"), 7, ",roof,");
    test::write_bytes(flux.table, table);
    CHECK(flux.validate().output.find("reference.csv:5: where \"roof\": there is none") != std::string::npos);
    table.replace(table.find("flux_neutral,"), 12, "flux_neutrals");
    test::write_bytes(flux.table, table);
    CHECK(flux.validate().output.find(
              "figure \"flux_neutrals\": there is none: did you mean flux_neutral?") != std::string::npos);
    test::write_bytes(flux.recipe, "[domain]\nextent = -1\n");
    CHECK(flux.validate().output.find("mine/recipe.toml:2: ") != std::string::npos);
    std::filesystem::remove(flux.recipe);
    CHECK(flux.validate().output.find(
              "mine/recipe.toml: is missing: a case is a folder with recipe.toml and reference.csv") !=
          std::string::npos);
    CHECK(test::run_program(flux.folder.path, "validate --cases none").output.find("none: holds no case") !=
          std::string::npos);
}

TEST_CASE("ten parts of a pulse are enough for the dose that half fills the floor of a deep via") {
    const OneCase one("ald_via");
    test::write_bytes(one.table,
                      "# title: t\n# source: s\nfigure,label,unit,reference,bar,where,z_to,set:step[0].parts,"
                      "set:step[0].pulse,set:step[0].duration\n"
                      "coverage_precursor,half,1,0.5,0.004,floor,-19.9,10,176.46,176.46\n");
    const test::Outcome outcome = one.validate(" --json -");
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    CHECK(nlohmann::json::parse(outcome.output)["cases"][0]["readings"][0]["ours"].get<double>() ==
          Approx(0.5).margin(0.004));  // 0.013 off if each part took the fluxes at its beginning
}
