#include "app/workbench/workbench.hpp"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "app/common/files.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/report/recipe_page.hpp"
#include "app/workbench/opened_folder.hpp"
#include "app/workbench/runs.hpp"
#include "tests/folder.hpp"

// What the page may reach and learn of the opened folder; requests that need no other process.
namespace {

namespace fs = std::filesystem;
using namespace sidewall::app;
using sidewall::test::Folder;

const std::string kRecipe = "# by hand\n[domain]\nextent = [4.0]\n";

struct Opened {
    Folder outside, inside;
    OpenedFolder folder{inside.path};

    Opened() {
        std::ofstream(outside.path / "secret.toml") << "secret\n";
        std::ofstream(inside.path / "a.toml") << kRecipe;
        fs::create_directories(inside.path / "deep/er");
        std::ofstream(inside.path / "deep/er/b.toml") << kRecipe;
        fs::create_symlink(outside.path / "secret.toml", inside.path / "link.toml");
        fs::create_directory_symlink(outside.path, inside.path / "away");
        fs::create_directory_symlink(inside.path / "deep", inside.path / "round");
        mkfifo((inside.path / "pipe.toml").c_str(), 0600);
    }

    WebReply get(const std::string& path, const std::string& name, const std::string& value) const {
        return answer({.method = "GET", .path = path, .query = {{name, value}}, .body = {}});
    }
    WebReply post(const std::string& path, const Json& body) const {
        return answer({.method = "POST", .path = path, .query = {}, .body = body.dump()});
    }
    WebReply answer(const WebRequest& request) const { return workbench_reply(request, folder, "a.toml"); }
};

std::string text_of(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("no name leads out of the opened folder: all such are not there", "[foreign]") {
    const Opened opened;
    const Json found = Json::parse(opened.get("/api/text", "path", "deep/er/b.toml").body);
    CHECK(found["text"] == kRecipe);
    const std::string outside = (opened.outside.path / "secret.toml").string();
    const std::vector<std::string> names{"../" + opened.outside.path.filename().string() + "/secret.toml",
                                         "deep/../../x.toml",
                                         "..",
                                         ".",
                                         "",
                                         "/",
                                         outside,
                                         "/etc/passwd",
                                         "./a.toml",
                                         "a.toml/",
                                         "deep//er/b.toml",
                                         "link.toml",
                                         "away/secret.toml",
                                         "round/er/b.toml",
                                         "pipe.toml",
                                         "none.toml",
                                         "a.toml/b.toml",
                                         "deep",
                                         std::string("a.toml\0", 7),
                                         std::string("a.toml\0.toml", 12),
                                         "a.toml\n",
                                         std::string(5000, 'a')};
    for (const std::string& name : names) {
        CAPTURE(name);
        CHECK(opened.get("/api/text", "path", name).status == 404);
        CHECK(opened.get("/api/log", "run", name).body.find("secret") == std::string::npos);
        const Json saving{{"path", name}, {"text", "new"}, {"digest", ""}};
        const WebReply reply = opened.post("/api/save", saving);
        CHECK((reply.status == 404 || Json::parse(reply.body).contains("problem") || name == "none.toml"));
        Json starting{{"command", "run"}, {"recipe", "a.toml"}, {"output", name + "/x"}};
        if (name != "deep" && name != "none.toml") CHECK_THROWS(start_run(opened.folder, starting));
        starting["output"] = name;
        if (name != "deep" && name != "none.toml") CHECK_THROWS(start_run(opened.folder, starting));
    }
    CHECK(text_of(opened.outside.path / "secret.toml") == "secret\n");
    CHECK(std::distance(fs::directory_iterator(opened.outside.path), {}) == 1);
}

TEST_CASE("the folder's list has recipes and results, through no link", "[foreign]") {
    const Opened opened;
    fs::create_directories(opened.inside.path / "results/one");
    std::ofstream(opened.inside.path / "results/one/timeline.csv") << "step,time [s]\n1,0.5\n";
    std::ofstream(opened.inside.path / "results/one/recipe.toml") << kRecipe;
    fs::create_directories(opened.inside.path / ".hidden");
    std::ofstream(opened.inside.path / ".hidden/c.toml") << kRecipe;
    const OpenedFolder::Contents contents = opened.folder.contents();
    CHECK(contents.recipes == std::vector<std::string>{"a.toml", "deep/er/b.toml"});
    CHECK(contents.results == std::vector<std::string>{"results/one"});
    const Json list = Json::parse(opened.get("/api/contents", "", "").body);
    CHECK(list["recipe"] == "a.toml");
    CHECK(list["runs"][0]["state"] == "stopped");
    CHECK_FALSE(stop_run(opened.folder, "results/one"));
}

TEST_CASE("a recipe is saved as it was typed, and not over a change that the page has not seen") {
    const Opened opened;
    const Json found = Json::parse(opened.get("/api/text", "path", "a.toml").body);
    const std::string typed = kRecipe + "# more\r\n\tmore";
    Json saving{{"path", "a.toml"}, {"text", typed}, {"digest", found["digest"]}};
    const Json saved = Json::parse(opened.post("/api/save", saving).body);
    CHECK(text_of(opened.inside.path / "a.toml") == typed);
    saving["digest"] = saved["digest"];
    std::ofstream(opened.inside.path / "a.toml") << "by an editor\n";
    CHECK(Json::parse(opened.post("/api/save", saving).body)["changed"] == true);
    CHECK(text_of(opened.inside.path / "a.toml") == "by an editor\n");
    // A new file is saved in a folder that is created for it, but not over an existing file.
    CHECK(
        Json::parse(opened.post("/api/save", {{"path", "new/c.toml"}, {"text", typed}, {"digest", ""}}).body)
            .contains("digest"));
    CHECK(text_of(opened.inside.path / "new/c.toml") == typed);
    CHECK(Json::parse(opened.post("/api/save", {{"path", "a.toml"}, {"text", "x"}, {"digest", ""}})
                          .body)["changed"] == true);
    // A file that was removed meanwhile is written again once the page has asked its user.
    fs::remove(opened.inside.path / "a.toml");
    const Json removed = Json::parse(opened.post("/api/save", saving).body);
    CHECK(removed["changed"] == true);
    saving["digest"] = removed["digest"];
    CHECK(Json::parse(opened.post("/api/save", saving).body).contains("digest"));
    CHECK(text_of(opened.inside.path / "a.toml") == typed);
    CHECK(Json::parse(opened.post("/api/save", {{"path", "run.sh"}, {"text", "x"}, {"digest", ""}}).body)
              .contains("problem"));
}

TEST_CASE("a file that is saved keeps its rights") {
    const Opened opened;
    fs::permissions(opened.inside.path / "a.toml", fs::perms(0640));
    opened.folder.write("a.toml", "new", digest(kRecipe));
    CHECK(text_of(opened.inside.path / "a.toml") == "new");
    CHECK(fs::status(opened.inside.path / "a.toml").permissions() == fs::perms(0640));
}

TEST_CASE("a recipe is not run as another text than the page shows") {
    const Opened opened;
    const Json asked{{"command", "run"}, {"recipe", "a.toml"}, {"output", "x"}, {"digest", digest("old")}};
    const Json reply = Json::parse(opened.post("/api/start", asked).body);
    CHECK(reply["changed"] == true);
    CHECK(reply["digest"] == digest(kRecipe));
    CHECK_FALSE(fs::exists(opened.inside.path / "x.log"));
}

TEST_CASE("results with a link among them are not listed, and a report reads none that has one",
          "[foreign]") {
    const Opened opened;
    const fs::path results = opened.inside.path / "results";
    for (const char* name : {"good", "table", "recipe", "below"}) {
        fs::create_directories(results / name / "runs");
        std::ofstream(results / name / "timeline.csv") << "step,time [s]\n1,0.5\n";
    }
    fs::remove(results / "table/timeline.csv");
    fs::create_symlink(opened.outside.path / "secret.toml", results / "table/timeline.csv");
    fs::create_symlink(opened.outside.path / "secret.toml", results / "recipe/recipe.toml");
    fs::create_symlink(opened.outside.path / "secret.toml", results / "below/runs/summary.json");
    CHECK(opened.folder.contents().results == std::vector<std::string>{"results/below", "results/good"});
    CHECK_NOTHROW(opened.folder.refuse_links("results/good"));
    CHECK_THROWS_AS(opened.folder.refuse_links("results/below"), NotInside);
    CHECK(opened.get("/api/results", "run", "results/below").status == 404);
    fs::remove(results / "good/timeline.csv");
    mkfifo((results / "good/timeline.csv").c_str(), 0600);  // opening this pipe would block for ever
    CHECK(opened.folder.contents().results == std::vector<std::string>{"results/below"});
    CHECK_THROWS_AS(last_of_timeline(results / "good/timeline.csv"), sidewall::FileError);
}

TEST_CASE(
    "a folder that is renamed while it is open is read, written and worked in, its old name leads nowhere",
    "[foreign]") {
    const Opened opened;
    const fs::path old = opened.inside.path, moved = old.string() + "-moved";
    fs::create_directories(old / "results/one");
    std::ofstream(old / "results/one/summary.json") << R"({"time": 5, "metrology": {"depth": 2}})";
    fs::rename(old, moved);
    fs::create_directory_symlink(opened.outside.path, old);
    std::ofstream(opened.outside.path / "a.toml") << "secret\n";
    CHECK(Json::parse(opened.get("/api/text", "path", "a.toml").body)["text"] == kRecipe);
    const Json saving{{"path", "deep/new.toml"}, {"text", "new"}, {"digest", ""}};
    CHECK(Json::parse(opened.post("/api/save", saving).body)["digest"] == digest("new"));
    CHECK(text_of(moved / "deep/new.toml") == "new");
    opened.folder.write("a.toml", "newer", digest(kRecipe));
    CHECK(text_of(moved / "a.toml") == "newer");
    const Json list = Json::parse(opened.get("/api/contents", "", "").body);
    CHECK(list["recipes"] == Json{"a.toml", "deep/er/b.toml", "deep/new.toml"});
    CHECK(list["runs"][0]["time"] == 5);
    CHECK(Json::parse(opened.get("/api/table", "", "").body)["rows"][0] == Json{"results/one", 2});
    {
        const Descriptor log = opened.folder.open_log("logs/pwd.log");
        start_program({"pwd", "-P"}, opened.folder.folder("deep").number(), log.number());
    }
    for (int k = 0; k < 500 && text_of(moved / "logs/pwd.log").empty(); ++k) usleep(10'000);
    CHECK(text_of(moved / "logs/pwd.log") == (moved / "deep").string() + "\n");
    forget_ended();
    CHECK(text_of(opened.outside.path / "a.toml") == "secret\n");
    CHECK(std::distance(fs::directory_iterator(opened.outside.path), {}) == 2);
    fs::remove(old);
    fs::rename(moved, old);
}

TEST_CASE(
    "a link that comes to stand for a folder or a file of results after they were listed is not followed",
    "[foreign]") {
    const Opened opened;
    const fs::path one = opened.inside.path / "results/one", outside = opened.outside.path;
    const std::vector<std::pair<std::string, std::string>> files{
        {"summary.json", R"({"time": 77, "time_unit": "secret", "metrology": {"secret": 77}})"},
        {"timeline.csv", "step,time [s],relative_error,secret\n1,77,0,77\n"},
        {"recipe.toml", "[domain]\nsecret = 77\ntime_unit = \"secret\"\n[[step]]\nduration = 77\n"},
        {"sweep.json", R"({"rows": 1})"},
        {"sweep.csv", "run\n1\n"},
        {"fit.json", R"({"parameters": 77})"},
        {".sidewall.lock", "process 77 on secret, since then"}};
    for (const auto& [name, text] : files) std::ofstream(outside / name) << text;
    for (const auto& [name, text] : files) {
        CAPTURE(name);
        fs::create_directories(one);
        if (name == "fit.json") std::ofstream(one / "sweep.json") << R"({"rows": 5})";
        fs::create_symlink(outside / name, one / name);
        Json run = run_json(opened.folder, "results/one");
        run.erase("stamp");  // modification times of the links themselves
        CHECK(run["state"] == "stopped");
        CHECK(run.dump().find("77") == std::string::npos);
        CHECK(run.dump().find("secret") == std::string::npos);
        CHECK(table_json(opened.folder).dump().find("77") == std::string::npos);
        CHECK_FALSE(stop_run(opened.folder, "results/one"));
        fs::remove_all(one);
    }
    fs::create_directory_symlink(outside, one);
    CHECK_THROWS_AS(run_json(opened.folder, "results/one"), NotInside);
    CHECK_THROWS_AS(stop_run(opened.folder, "results/one"), NotInside);
    CHECK_THROWS_AS(opened.folder.open_log("results/one/x.log"), NotInside);
    CHECK(std::distance(fs::directory_iterator(outside), {}) == 8);
}

TEST_CASE("a run's total time is that of its recipe's steps, of loops as often as they go round") {
    const Opened opened;
    const fs::path run = opened.inside.path / "run";
    fs::create_directories(run);
    std::ofstream(run / "timeline.csv") << "step,time [min]\n1,0.5\n";
    std::ofstream(run / "recipe.toml") << effective_recipe(parse_recipe(R"(
[domain]
extent = [1.0, 1.0]
grid_spacing = 0.1
time_unit = "min"
[[layer]]
material = "Si"
[[step]]
model = "isotropic"
rate = -0.01
duration = 1.5
[[step]]
repeat = 3
[[step.steps]]
model = "isotropic"
rate = -0.01
duration = 0.25
[[step.steps]]
repeat = 2
[[step.steps.steps]]
model = "isotropic"
rate = -0.01
duration = 0.125
)",
                                                                        "a.toml"));
    const Json json = run_json(opened.folder, "run");
    CHECK(json["total"] == 1.5 + 3 * (0.25 + 2 * 0.125));
    CHECK(json["unit"] == "min");
}

TEST_CASE("a hostile body of 4 MB is refused, however it is made", "[foreign]") {
    const Opened opened;
    const auto many = [](const std::string& open, const auto& part, const std::string& close) {
        std::string text = open;
        for (std::size_t k = 0; text.size() < 3'900'000; ++k) text += part(k);
        return text + close;
    };
    const auto repeated = [](const char* text) { return [text](std::size_t) { return text; }; };
    const std::vector<std::string> bodies{
        many(
            "{", [](std::size_t k) { return "\"" + std::to_string(k) + "\":0,"; }, "\"\":0}"),
        many(
            "{\"path\":{", [](std::size_t k) { return "\"" + std::to_string(k) + "\":0,"; }, "\"\":0}}"),
        many("{\"a\":[", repeated("0,"), "0]}"),
        many("{\"a\":[", repeated("{\"a\":1},"), "0]}"),
        many("", repeated("["), ""),
        many("", repeated("{\"a\":"), ""),
        many("{\"a\":", repeated("1"), "}"),
        many("{\"a\":0.", repeated("1"), "}"),
        many("{\"path\":\"", repeated("\\u0001"), "\"}"),
        many("{\"path\":\"a.toml\",\"digest\":\"\",\"text\":\"", repeated("\\u0000"), "\"}"),
        many("{\"text\":\"", repeated("1,"), "\"}"),
        many("{\"text\":\"", repeated("1,\\n"), "\"}"),
        many("{\"text\":\"", repeated("\\n"), "\"}")};
    for (const std::string& body : bodies) {
        CAPTURE(body.substr(0, 40));
        for (const char* path : {"/api/save", "/api/profile", "/api/start", "/api/stop"}) {
            const WebReply reply = opened.answer({"POST", path, {}, body});
            const bool refused = reply.status >= 400 || Json::parse(reply.body).contains("problem");
            CHECK(refused);
        }
    }
}

TEST_CASE("a list of surfaces leads to files beside it alone", "[foreign]") {
    const Folder run;
    std::ofstream(run.path / "surface.pvd")
        << R"(<VTKFile><DataSet timestep="0" file="/tmp/surface_0000.vtp"/>)"
        << R"(<DataSet timestep="1" file="../a/surface_0001.vtp"/></VTKFile>)";
    const std::vector<SavedSurface> saved = saved_surfaces(run.path);
    CHECK(saved.at(0).file == run.path / "surface_0000.vtp");
    CHECK(saved.at(1).file == run.path / "surface_0001.vtp");
}

TEST_CASE("of a long timeline the last whole row is read", "[foreign]") {
    const Folder run;
    std::ofstream file(run.path / "timeline.csv");
    file << "step,time [s],depth [um]\n";
    CHECK((file.flush(), last_of_timeline(run.path / "timeline.csv").rows.empty()));
    for (int k = 1; k <= 10'000; ++k) file << "\"1 a, b\"," << k << ",0.5\n";
    file << "1,10001,0." << std::flush;
    const TextTable table = last_of_timeline(run.path / "timeline.csv");
    CHECK(table.names == std::vector<std::string>{"step", "time [s]", "depth [um]"});
    CHECK(table.rows == std::vector<std::vector<std::string>>{{"1 a, b", "10000", "0.5"}});
    file << "\n1,2\n" << std::flush;
    CHECK_THROWS_AS(last_of_timeline(run.path / "timeline.csv"), sidewall::FileError);
}

TEST_CASE("of a timeline without a line's end no more is read than a line may have", "[foreign]") {
    const Folder run;
    const fs::path timeline = run.path / "timeline.csv";
    std::ofstream(timeline) << "step,time [s]";  // its first line is being written
    CHECK(last_of_timeline(timeline).names == std::vector<std::string>{"step", "time [s]"});
    fs::resize_file(timeline, std::uintmax_t{1} << 40);
    CHECK_THROWS_AS(last_of_timeline(timeline), sidewall::FileError);
}

TEST_CASE("a table of runs has the first figures of many, and says so", "[foreign]") {
    RunRow row{.name = "one"};
    for (int k = 0; k < 60; ++k) row.figures["figure" + std::to_string(k)] = {k, ""};
    CHECK(runs_table({row})["columns"].size() == 61);
    CHECK_FALSE(runs_table({row}).contains("note"));
    std::string names = "step,time [s],relative_error", values = "1,1,0";
    for (int k = 0; k < 5000; ++k) {
        names += ",f" + std::to_string(k);
        values += ",7";
    }
    const Folder run;
    std::ofstream(run.path / "timeline.csv") << names << "\n" << values << "\n";
    const Json table = runs_table({row, run_row("two", "", "", run.path / "timeline.csv")});
    CHECK(table["columns"].size() == 61);
    CHECK(table["rows"][1].size() == 61);
    CHECK(table["note"].get<std::string>().find("60") != std::string::npos);
}

TEST_CASE("writes 17 MB", "[.]") {  // run by the next test
    std::cout << std::string(17'000'000, 'x');
}

TEST_CASE("an answer that is too large is refused, not cut", "[foreign]") {
    const Opened opened;
    const Descriptor here = opened.folder.folder("");
    CHECK_THROWS_WITH(run_self({"writes 17 MB"}, here.number(), ""), Catch::Contains("over 16000000"));
}

TEST_CASE("the list of a large folder ends at a bound, and says so", "[foreign]") {
    const Opened opened;
    CHECK(opened.folder.contents().whole);
    CHECK(Json::parse(opened.get("/api/contents", "", "").body)["cut"] == false);
    fs::create_directories(opened.inside.path / "many");
    for (int k = 0; k < 600; ++k) std::ofstream(opened.inside.path / "many" / (std::to_string(k) + ".toml"));
    CHECK_FALSE(opened.folder.contents().whole);
    const OpenedFolder::Contents contents = opened.folder.contents();
    CHECK(contents.recipes.size() == 500);
    CHECK(std::ranges::count(contents.recipes, "a.toml") == 1);
    CHECK(Json::parse(opened.get("/api/contents", "", "").body)["cut"] == true);
}

TEST_CASE("a file in another encoding is not opened, as saving would damage it") {
    const Opened opened;
    std::ofstream(opened.inside.path / "latin.toml") << "# gef\xfcllt\n";
    const Json reply = Json::parse(opened.get("/api/text", "path", "latin.toml").body);
    CHECK(reply["problem"].get<std::string>().find("UTF-8") != std::string::npos);
    CHECK_FALSE(reply.contains("text"));
}

TEST_CASE("a program that was started leaves nothing behind when it has ended") {
    const Folder folder;
    start_program({"true"}, OpenedFolder(folder.path).folder("").number(), -1);
    const auto none_left = [] {
        forget_ended();
        return waitpid(-1, nullptr, WNOHANG) < 0 && errno == ECHILD;
    };
    bool gone = false;
    for (int k = 0; k < 500 && !gone; ++k) {
        usleep(10'000);
        gone = none_left();
    }
    CHECK(gone);
}

TEST_CASE("the page offers chemistries of a step's own model, and all by name") {
    const Opened opened;
    const Json keys = Json::parse(opened.get("/api/keys", "", "").body);
    CHECK(keys["decks"]["c4f8_ar_oxide"] == "fluorocarbon");
    for (const Json& section : keys["sections"])
        for (const Json& key : section["keys"])
            if (key["name"] == "chemistry")
                for (const Json& word : key["words"])
                    CHECK(keys["decks"][word.get<std::string>()] == section["name"]);
}

TEST_CASE("what is no request of the page gets 400 or 404", "[foreign]") {
    const Opened opened;
    for (const char* body : {"", "[]", "{", "null", "\"text\"", "{\"path\": 1"})
        CHECK(opened.answer({"POST", "/api/check", {}, body}).status == 400);
    for (const char* path :
         {"/api/save", "/api/check", "/api/preview", "/api/stop", "/api/profile", "/api/none"}) {
        CHECK(opened.post(path, Json::object()).status == 404);
        CHECK(opened.post(path, {{"path", 7}, {"text", Json::array()}, {"run", nullptr}}).status == 404);
    }
    CHECK(opened.get("/api/results", "last", "1").status == 404);
    CHECK(opened.get("/api/text", "shipped", "../README.md").status == 404);
    CHECK(opened.get("/favicon.ico", "", "").status == 404);
}

TEST_CASE("a command line for a run has the page's words as values, never as options") {
    const Opened opened;
    std::ofstream(opened.inside.path / "-o.toml") << kRecipe;
    CHECK(command_words(opened.folder, {{"command", "sweep"},
                                        {"recipe", "-o.toml"},
                                        {"output", "-x"},
                                        {"vary", {"--jobs"}},
                                        {"resume", true}}) ==
          std::vector<std::string>{"sidewall", "sweep", "./-o.toml", "-o", "./-x", "--resume",
                                   "--vary=--jobs"});
    CHECK_THROWS_AS(command_words(opened.folder, {{"command", "simplify"}, {"recipe", "a.toml"}}),
                    sidewall::RecipeError);
    CHECK_THROWS_AS(command_words(opened.folder, {{"command", "run"}, {"recipe", "../a.toml"}}), NotInside);
    CHECK_THROWS_AS(
        command_words(opened.folder,
                      {{"command", "fit"}, {"recipe", "a.toml"}, {"target_profile", {"link.toml"}}}),
        NotInside);
}

TEST_CASE("a recipe's picture has its masks as outlines, and of a tall stack a few thick layers") {
    Recipe recipe = parse_recipe(R"(
[domain]
extent = [4.0, 2.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
top = -6.0
[[layer]]
shape = "stack"
materials = ["SiO2", "Si3N4"]
thicknesses = [0.05, 0.05]
repeat = 60
[[step]]
model = "mask"
material = "Resist"
thickness = 0.5
polygons = [{ points = [-1.0, -0.5, 1.0, -0.5, 1.0, 0.5, -1.0, 0.5] }]
[[step]]
model = "cut"
depth = 1.0
shape = "hole"
radius = 0.5
)",
                                 "tall.toml");
    const Page page = recipe_page(recipe, 4'000'000);
    const Json& view = page.sections.at(0);
    CHECK(view["outlines"].size() == 2);
    CHECK(view["outlines"][0] == Json::parse("[[-1.0,-0.5],[1.0,-0.5],[1.0,0.5],[-1.0,0.5]]"));
    CHECK(view["outlines"][1].size() == 64);
    CHECK(view["frames"][0]["layers"].size() <= 13);
    CHECK(view["note"].get<std::string>().find("13 in all, of 121") != std::string::npos);
    CHECK(view["max"][2].get<double>() == Approx(0.0).margin(0.01));  // the height of the recipe's wafer
}

TEST_CASE("keys of an effective recipe have the paths that --set takes") {
    const auto keys = written_keys(
        "[domain]\nextent = [4.0, 2.0]  # um\n\n[[layer]]\nmaterial = \"Si\"\n\n[[step]]\nrepeat = 2\n\n"
        "[[step.steps]]\nduration = 1.0  # s\n\n[[step.steps]]\nduration = 2.0  # s\n\n[[step]]\nname = \"a  # b\"  # s\n");
    CHECK(keys.at("domain.extent") == "[4.0, 2.0]");
    CHECK(keys.at("layer[0].material") == "\"Si\"");
    CHECK(keys.at("step[0].repeat") == "2");
    CHECK(keys.at("step[0].steps[1].duration") == "2.0");
    CHECK(keys.at("step[1].name") == "\"a  # b\"");
}
