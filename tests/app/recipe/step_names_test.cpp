#include <catch2/catch.hpp>

#include "app/models/model.hpp"
#include "app/recipe/node_path.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/steps.hpp"
#include "app/sweep/vary.hpp"

// Keys of steps by the steps' names.
using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

const std::string kNamedSteps = R"([domain]
extent = [2.0]
grid_spacing = 0.1
[[layer]]
material = "Si"
[[step]]
name = "liner"
model = "single_particle"
duration = 1.0
rate = 0.1
deposit = "SiO2"
[[step]]
repeat = 2
[[step.steps]]
name = "main etch"
model = "isotropic"
duration = 2.0
rate = -0.1
[[step.steps]]
name = "clean"
model = "isotropic"
duration = 3.0
rate = -0.1
[[step]]
name = "clean"
model = "isotropic"
duration = 4.0
rate = -0.1
)";

Recipe set(const std::vector<std::string>& settings) {
    return parse_recipe(kNamedSteps, "names.toml", settings);
}

}  // namespace

TEST_CASE("an override finds a step by its name, in loops too") {
    CHECK(set({"step.liner.duration=7"}) == set({"step[0].duration=7"}));
    CHECK(set({"step.\"main etch\".duration=7"}) == set({"step[1].steps[0].duration=7"}));
    CHECK(set({"step.'main etch'.rate={ Si = -0.2 }"}) == set({"step[1].steps[0].rate={ Si = -0.2 }"}));
    CHECK(set({"step[2].name=\"last\"", "step.last.duration=7", "step.clean.duration=8"}) ==
          set({"step[2].name=\"last\"", "step[2].duration=7", "step[1].steps[1].duration=8"}));
    CHECK(written_number(kNamedSteps, "names.toml", {}, "step.\"main etch\".duration") == 2.0);
    const std::string odd = R"(n "x", it's = 3 \)";
    CHECK(path_by_name(odd) == R"(step."n \"x\", it's = 3 \\")");
    CHECK(set({"step[0].name=" + toml_text(odd), path_by_name(odd) + ".duration=7"}) ==
          set({"step[0].name=" + toml_text(odd), "step[0].duration=7"}));
    CHECK(parse_vary(path_by_name(odd) + ".duration=1:2").key == path_by_name(odd) + ".duration");
    CHECK_THROWS_WITH(set({"step.linre.duration=7"}),
                      Contains("--set step.linre.duration=7: no step is named linre; did you mean liner?") &&
                          Contains("there are liner, main etch, clean"));
    CHECK_THROWS_WITH(set({"step.duration=7"}), Contains("no step is named duration"));
    CHECK_THROWS_WITH(set({"step.clean.duration=7"}),
                      Contains("several steps are named clean: write step[1].steps[1] or step[2]"));
    CHECK_THROWS_WITH(set({"step.liner[0].duration=7"}), Contains("no step is named"));
    CHECK_THROWS_WITH(set({"step.liner.duratoin=7"}),
                      Contains("--set step.liner.duratoin=7") && Contains("did you mean duration?"));
    CHECK_THROWS_WITH(set({"step.\"main etch.duration=7"}), Contains("must be key=value"));
    std::string nameless = kNamedSteps;
    for (auto at = nameless.find("name = "); at != std::string::npos; at = nameless.find("name = "))
        nameless.erase(at, nameless.find('\n', at) - at);
    CHECK_THROWS_WITH(parse_recipe(nameless, "names.toml", {"step.etch.duration=7"}),
                      Contains("none has a name: count from 0, e.g. step[0].duration"));
}

TEST_CASE("a varied key knows the key of a step by its name, and that it is varied twice") {
    const Recipe recipe = set({});
    const std::vector<KeyDoc> keys = settable_keys(recipe);
    const auto offered = [&](const char* name) {
        return std::any_of(keys.begin(), keys.end(), [&](const KeyDoc& key) { return key.name == name; });
    };
    CHECK(offered("step.liner.sticking"));
    CHECK(offered("step.\"main etch\".rate"));
    CHECK_FALSE(offered("step.clean.rate"));  // two steps have this name
    CHECK_FALSE(offered("step.liner.steps[0].rate"));
    const std::vector<Vary> varied =
        parse_vary({"step.liner.repeat=1:9", "step.liner.sticking=0.1:1"}, recipe);
    CHECK(varied[0].key == "step.liner.repeat");
    CHECK(varied[0].whole);
    CHECK_FALSE(varied[1].whole);
    CHECK_THROWS_WITH(parse_vary({"step.liner.rate=1:2", "step[0].rate=1:2"}, recipe),
                      Contains("varied twice"));
    CHECK_THROWS_WITH(parse_vary({"step.lin.rate=1:2"}, recipe),
                      Contains("--vary step.lin.rate=1:2: no step is named lin"));
}
