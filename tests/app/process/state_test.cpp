#include "app/process/wafer.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>

#include "surface/error.hpp"
#include "tests/folder.hpp"

using namespace sidewall;
using namespace sidewall::app;
using Catch::Matchers::Contains;

namespace {

const std::string kRecipe = R"([domain]
extent = [2.0, 2.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
[[step]]
model = "isotropic"
duration = 1.0
rate = -0.1
)";

// A flat sheet with a coverage of one half.
SurfaceField half_covered() {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    SurfaceField field;
    field.scene = std::make_shared<const surface::RayScene>(mesh);
    field.names = {"theta"};
    field.corner = {std::vector<double>(6, 0.5)};
    return field;
}

}  // namespace

TEST_CASE("a state comes back from its checkpoint, one that no run can be in is refused by name") {
    const test::Folder folder;
    const Recipe recipe = parse_recipe(kRecipe, "plane.toml");
    RunState good = initial_state(recipe);
    good.carried = half_covered();
    good.advance(0.25, 1.0);
    good.history.events = {{kVoidClosed, 0.1, 0, "", 2, 0.3, {0.1, 0.2, 0.3}}};
    save_state(folder.path, recipe, good);
    const RunState back = resume_state(folder.path, recipe);
    CHECK(back.time == 0.25);
    CHECK(back.time_steps == good.time_steps);
    CHECK(back.carried.corner == good.carried.corner);
    CHECK(back.history.initial == good.history.initial);
    REQUIRE(back.history.events.size() == 1);
    CHECK(back.history.events[0].at == good.history.events[0].at);

    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = 1e308 * 10.0;
    const std::vector<std::function<void(RunState&)>> faults = {
        [&](RunState& s) { s.carried.corner[0][3] = nan; },
        [&](RunState& s) { s.carried.corner[0][0] = -infinity; },
        [&](RunState& s) { s.step = 2; },
        [&](RunState& s) { s.step = std::numeric_limits<std::size_t>::max(); },
        [&](RunState& s) { s.time_steps.clear(); },
        [&](RunState& s) { s.time = nan; },
        [&](RunState& s) { s.time = infinity; },
        [&](RunState& s) { s.step_start = 0.5; },
        [&](RunState& s) { s.stack.layers[0].material = 1000; },
        [&](RunState& s) { s.stack.layers[0].material = -1; },
        [&](RunState& s) { s.history.initial[0] = nan; },
        [&](RunState& s) { s.history.added.clear(); },
        [&](RunState& s) { s.history.layer_materials[0] = 1000; },
        [&](RunState& s) { s.history.events[0].step = 1; },
        [&](RunState& s) { s.history.events[0].at.x() = nan; },
        [&](RunState& s) {
            s.files = {{0.0, 0, "../../surface_0000.vtp"}};
        },
    };
    for (std::size_t k = 0; k < faults.size(); ++k) {
        CAPTURE(k);
        RunState bad = good;
        faults[k](bad);
        save_state(folder.path, recipe, bad);
        CHECK_THROWS_AS(resume_state(folder.path, recipe), FileError);
        CHECK_THROWS_WITH(resume_state(folder.path, recipe),
                          Contains((folder.path / "checkpoint.vdb").string() + ": "));
    }
}

TEST_CASE(
    "a time step that the time cannot tell from nothing is refused, and a short step counts from its start") {
    RunState state;
    state.enter(0);
    state.begin_step(1e8);
    state.advance(1e8, 1e8);
    state.enter(1);
    RunState other = state;
    CHECK_THROWS_AS(other.advance(1e-9, 1e8 + 1.0), NumericsError);
    state.begin_step(1e-7);
    CHECK(state.begins_step());
    CHECK(state.process_time() == 1e8);
    for (int n = 0; n < 100; ++n) state.advance(1e-9, state.step_start + 1e-7);
    CHECK(state.reached(state.step_start + 1e-7));
    CHECK(state.since(state.starts[1]) == 1e-7);
}

TEST_CASE("a run does not go on if a table, a source or the run that it started from has been edited") {
    const test::Folder folder;
    const auto write = [&](const char* name, const std::string& text) {
        std::ofstream(folder.path / name, std::ios::binary) << text;
    };
    const std::string table = "x,rate\n0,-1\n1,-2\n", source = "angle,intensity\n0,1\n60,0\n";
    write("rates.csv", table);
    write("angles.csv", source);
    write("same.csv", source);
    const Recipe first = parse_recipe(kRecipe, "plane.toml", {"domain.strip=\"space\""});
    std::filesystem::create_directory(folder.path / "first");
    write("first/summary.json", "{}");
    save_state(folder.path / "first", first, initial_state(first));
    const Recipe recipe = parse_recipe(R"([domain]
extent = [2.0, 2.0]
grid_spacing = 0.25
strip = "space"
[start]
from = "first"
[[step]]
repeat = 2
[[step.steps]]
model = "formula"
duration = 1.0
rate = "rates(x)*gas"
tables = [{ name = "rates", file = "rates.csv" }]
species = [{ name = "gas", source_file = "angles.csv" }, { name = "ions", source_file = "same.csv" }]
)",
                                       (folder.path / "second.toml").string());
    // Two files of equal contents are not taken for one that has moved.
    std::filesystem::create_directory(folder.path / "second");
    save_state(folder.path / "second", recipe, initial_state(recipe));
    const auto refuses = [&](const char* name) {
        CHECK_THROWS_WITH(resume_state(folder.path / "second", recipe),
                          Contains((folder.path / name).string() + " is not what it was"));
    };
    CHECK_NOTHROW(resume_state(folder.path / "second", recipe));
    write("rates.csv", "x,rate\n0,-1\n1,-3\n");
    refuses("rates.csv");
    write("rates.csv", table);
    write("angles.csv", "angle,intensity\n0,1\n30,0\n");
    refuses("angles.csv");
    write("angles.csv", source);
    CHECK_NOTHROW(resume_state(folder.path / "second", recipe));
    RunState longer = initial_state(first);
    longer.advance(0.25, 1.0);
    save_state(folder.path / "first", first, longer);
    refuses("first");
}
