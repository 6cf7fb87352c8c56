#include "app/workbench/workbench.hpp"

#include <sys/stat.h>
#include <unistd.h>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/common/files.hpp"
#include "app/report/recipe_page.hpp"
#include "app/workbench/opened_folder.hpp"
#include "app/workbench/runs.hpp"
#include "tests/folder.hpp"

// What the page may reach in the opened folder, and what it is told; requests that need no other process.
namespace {

namespace fs = std::filesystem;
using namespace sidewall::app;
using sidewall::test::Folder;

const std::string kRecipe = "# by hand\n[domain]\nextent = [4.0]\n";

struct Opened {
    Folder outside, inside;
    OpenedFolder folder{inside.path};
    Workbench workbench{folder, "a.toml"};

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
        return workbench.answer({.method = "GET", .path = path, .query = {{name, value}}, .body = {}});
    }
    WebReply post(const std::string& path, const Json& body) const {
        return workbench.answer({.method = "POST", .path = path, .query = {}, .body = body.dump()});
    }
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
    // A new one: in a folder that is made, and not over one that is there.
    CHECK(
        Json::parse(opened.post("/api/save", {{"path", "new/c.toml"}, {"text", typed}, {"digest", ""}}).body)
            .contains("digest"));
    CHECK(text_of(opened.inside.path / "new/c.toml") == typed);
    CHECK(Json::parse(opened.post("/api/save", {{"path", "a.toml"}, {"text", "x"}, {"digest", ""}})
                          .body)["changed"] == true);
    CHECK(Json::parse(opened.post("/api/save", {{"path", "run.sh"}, {"text", "x"}, {"digest", ""}}).body)
              .contains("problem"));
}

TEST_CASE("what is no request of the page gets 400 or 404", "[foreign]") {
    const Opened opened;
    for (const char* body : {"", "[]", "{", "null", "\"text\"", "{\"path\": 1"})
        CHECK(opened.workbench.answer({"POST", "/api/check", {}, body}).status == 400);
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
