#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/process/simulation.hpp"
#include "levelset/layers/stack.hpp"
#include "levelset/meshes/contact_lines.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/ray_scene.hpp"
#include "tests/integration/run_program.hpp"

// Conditions that end a step, and the times at which they do.
using namespace sidewall;
using nlohmann::json;

namespace {

const std::string kEndpointStrip = R"([domain]
extent = [2.0, 0.2]
grid_spacing = 0.05
boundary = ["reflective", "periodic"]
[simplify]
method = "none"
[[layer]]
material = "Si"
top = 0.0
)";

// Oxide of 0.3 with a trench that is half as wide as the wafer and leaves 0.2 of it.
const std::string kTwoFloors = kEndpointStrip + R"([[layer]]
material = "SiO2"
thickness = 0.3
shape = "trench"
width = 1.0
depth = 0.1
[[step]]
name = "etch"
model = "directional"
duration = 9.0
directional = { SiO2 = -0.1 }
)";

// Oxide of 0.4 under a mask with a slit of 1.0; the mask etches a tenth as fast.
const std::string kSlit = kEndpointStrip + R"([[layer]]
material = "SiO2"
thickness = 0.4
[[layer]]
material = "Resist"
thickness = 0.3
shape = "trench"
width = 1.0
[[step]]
name = "etch"
model = "directional"
duration = 9.0
directional = { SiO2 = -0.1, Resist = -0.01 }
)";

json step_of(const std::string& text, std::size_t number = 0) {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(text, "endpoint.toml");
    return app::run_recipe(recipe, {.output = folder.path, .quiet = true}).summary["steps"][number];
}

double number(const json& json) {
    return json.get<double>();
}

// A stop condition is overshot by at most a twentieth of a cell.
constexpr double kLate = 0.05 * 0.05 / 0.1 + 1e-9;

}  // namespace

TEST_CASE("a step ends when the share of the floor that it names is bare") {
    // Half of the floor is bare after 2 s, all of it after 3.
    const json half = step_of(kTwoFloors + "stop = \"bare(Si) > 0.3\"\n"),
               all = step_of(kTwoFloors + "stop = \"bare(Si) > 0.7\"\n"),
               material = step_of(kTwoFloors + "stop_material = \"Si\"\n");
    CHECK(number(half["duration"]) == Approx(2.0).margin(kLate));
    CHECK(number(half["endpoint"]["bare"]) == Approx(0.5).margin(0.05));  // a cell's edge at either wall
    CHECK(half["stopped_by"] == "stop");
    CHECK(half["endpoint"]["time"] == half["duration"]);
    CHECK(number(all["duration"]) == Approx(3.0).margin(kLate));
    CHECK(number(all["bare"]) > 0.7);
    CHECK(material["stopped_by"] == "stop_material");
    CHECK(number(material["duration"]) == Approx(3.0).margin(kLate));
    CHECK(number(material["bare"]) > 0.75);
}

TEST_CASE("a mask is no floor, however its material goes, as long as it goes slower by half") {
    for (const char* stop : {"stop = \"bare(Si) > 0.9\"\n", "stop_material = \"Si\"\n"}) {
        const json step = step_of(kSlit + stop);
        CHECK(number(step["duration"]) == Approx(4.0).margin(kLate));
        // Within a cell of a wall the front arrives a twentieth of a cell later.
        CHECK(number(step["bare"]) > 0.85);
    }
    // Without a mask the step is to remove the material that covers most of the wafer.
    const json open = step_of(kTwoFloors + "stop = \"bare(Si) > 0.9\"\n");
    CHECK(number(open["duration"]) == Approx(3.0).margin(kLate));
}

TEST_CASE("a mask that a liner covers as the step begins is no floor, nor is the liner on it") {
    // A slit of 1.0 in a mask, with a liner of 0.2 on its walls and floor; on the mask it is thicker, or not.
    for (const double more : {0.0, 0.15}) {
        const json step = step_of(kEndpointStrip + fmt::format(R"([[layer]]
material = "Resist"
thickness = 0.5
shape = "trench"
width = 1.0
[[layer]]
material = "SiO2"
top = {}
shape = "trench"
width = 0.6
depth = {}
[[step]]
model = "directional"
duration = 9.0
directional = {{ SiO2 = -0.1, Resist = -0.01 }}
stop = "bare(Si) > 0.9"
)",
                                                               0.7 + more, 0.5 + more));
        INFO(more << ": " << step);
        CHECK(step["stopped_by"] == "stop");
        CHECK(number(step["duration"]) == Approx(2.0).margin(kLate));
        CHECK(number(step["bare"]) > 0.9);
    }
}

TEST_CASE(
    "a film that fills the opening of a mask is floor, though a wall of the mask is nearer than the floor") {
    const test::Folder folder;
    const app::Recipe recipe = app::parse_recipe(kEndpointStrip + R"([[layer]]
material = "Resist"
thickness = 0.5
shape = "trench"
width = 1.0
[[layer]]
material = "SiO2"
top = 0.7
[[step]]
model = "directional"
duration = 9.0
directional = { SiO2 = -0.1, Resist = -0.01 }
stop = "bare(Si) > 0.9"
)",
                                                 "endpoint.toml");
    std::string lines;
    const json step = app::run_recipe(recipe, {.output = folder.path,
                                               .quiet = true,
                                               .warn = [&](std::string_view line) { lines += line; }})
                          .summary["steps"][0];
    CHECK(lines == "");  // that there is no floor
    CHECK(number(step["duration"]) == Approx(7.0).margin(kLate));
    CHECK(number(step["bare"]) > 0.9);
}

TEST_CASE("a layer that is slow to etch but lies everywhere under the openings is no mask") {
    const json step = step_of(kEndpointStrip + R"([[layer]]
material = "Si3N4"
thickness = 0.1
[[layer]]
material = "SiO2"
thickness = 0.2
[[layer]]
material = "Resist"
thickness = 0.3
shape = "trench"
width = 1.0
[[step]]
model = "directional"
duration = 20.0
directional = { SiO2 = -0.1, Si3N4 = -0.02 }
stop = "bare(Si) > 0.9"
)");
    CHECK(step["stopped_by"] == "stop");
    CHECK(number(step["duration"]) == Approx(2.0 + 5.0).margin(6.0 * kLate));
}

TEST_CASE("walls are no floor: a tapered trench is open though its floor is narrower than its mask") {
    // Below an opening of 1.0 the floor is 0.709 wide; it goes down as a whole.
    const json step = step_of(kEndpointStrip + R"([[layer]]
material = "SiO2"
thickness = 0.5
shape = "trench"
width = 1.0
depth = 0.4
taper_deg = 20.0
[[layer]]
material = "Resist"
thickness = 0.2
shape = "trench"
width = 1.0
depth = 0.6
[[step]]
model = "directional"
duration = 9.0
directional = { SiO2 = -0.1 }
stop = "bare(Si) > 0.9"
)");
    CHECK(step["stopped_by"] == "stop");
    CHECK(number(step["duration"]) == Approx(1.0).margin(2.0 * kLate));
}

TEST_CASE("what has none of the material below it is no floor") {
    // A line of tungsten of 0.6 in oxide, under a slit of 1.0: beside the line there is more oxide below.
    const json step = step_of(kEndpointStrip + R"([[layer]]
material = "W"
shape = "fin"
width = 0.6
height = 0.3
[[layer]]
material = "SiO2"
top = 0.5
[[layer]]
material = "Resist"
thickness = 0.2
shape = "trench"
width = 1.0
[[step]]
model = "directional"
duration = 9.0
directional = { SiO2 = -0.1 }
stop = "bare(W) > 0.85"
)");
    CHECK(step["stopped_by"] == "stop");
    CHECK(number(step["duration"]) == Approx(2.0).margin(2.0 * kLate));
}

TEST_CASE("an over-etch goes on after the endpoint, for a share of the time so far or a time") {
    const json share = step_of(kSlit + "stop = \"bare(Si) > 0.9\"\nover_etch = 0.25\n"),
               time = step_of(kSlit + "stop = \"bare(Si) > 0.9\"\nover_etch_time = 0.7\n"),
               depth = step_of(kSlit + "stop_depth = -0.1\nover_etch = 0.5\n"),
               cut = step_of(kSlit + "stop = \"bare(Si) > 0.9\"\nover_etch = 2.0\n");
    const auto came = [](const json& step) { return number(step["endpoint"]["time"]); };
    CHECK(came(share) == Approx(4.0).margin(kLate));
    CHECK(number(share["duration"]) == Approx(1.25 * came(share)));
    CHECK(number(share["endpoint"]["over_etch"]) == Approx(0.25 * came(share)));
    CHECK(share["stopped_by"] == "stop");
    CHECK(number(time["duration"]) == Approx(came(time) + 0.7));
    // Over-etch follows any stop condition; the oxide's top is at 0.4.
    CHECK(came(depth) == Approx(3.0).margin(kLate));
    CHECK(number(depth["duration"]) == Approx(1.5 * came(depth)));
    // No step takes longer than its duration.
    CHECK(cut["stopped_by"] == "duration");
    CHECK(cut["duration"] == 9.0);
    CHECK(came(cut) == Approx(4.0).margin(kLate));
}

TEST_CASE("a step that does not come to its endpoint says so, and what share was bare") {
    const json step = step_of(kTwoFloors + "stop = \"bare(Si) > 0.9\"\n[output]\nevery = 9.0\n");
    CHECK(number(step["bare"]) >= 0.9);  // the figure is rounded
    std::string brief = kTwoFloors + "stop = \"bare(Si) > 0.9\"\n";
    brief.replace(brief.find("duration = 9.0"), 14, "duration = 2.5");
    const json early = step_of(brief);
    CHECK(early["stopped_by"] == "duration");
    CHECK(early["endpoint"]["time"].is_null());
    CHECK(number(early["bare"]) == Approx(0.5).margin(0.05));
    const test::Folder folder;
    test::write_bytes(folder.path / "early.toml", brief);
    const auto outcome = test::run_program(folder.path, "run early.toml");
    INFO(outcome.output);
    CHECK(outcome.output.find("ended by its duration, before its stop condition held") != std::string::npos);
    CHECK(outcome.output.find("% of Si bare under the openings") != std::string::npos);
}

TEST_CASE("stops that make no sense are refused with what to write") {
    const auto refused = [](const std::string& keys, const std::string& words) {
        CHECK_THROWS_WITH(app::parse_recipe(kSlit + keys, "bad.toml"), Catch::Matchers::Contains(words));
    };
    refused("stop = \"bare(Sl) > 0.9\"\n", "there is no material Sl: did you mean Si");
    refused("stop = \"bare(W) > 0.9\"\n", "there is no W on the wafer");
    refused("stop = \"bare(Si) > 90\"\n", "a number between 0 and 1");
    refused("stop = \"bare(Si)\"\n", "must be a measure");
    refused("over_etch = 0.2\n", "goes on after an endpoint");
    refused("over_etch_time = 0.2\n", "goes on after an endpoint");
    refused("stop_depth = 0.1\nover_etch = -0.2\n", "over_etch");
    refused("stop_depth = 0.1\nover_etch = 0.2\nover_etch_time = 1.0\n", "drop one");
    refused("stop_material = \"Si\"\nstop = \"bare(Si) > 0.9\"\n", "drop stop_material");
}

TEST_CASE("a run that is stopped within an over-etch goes on to the same bits") {
    const app::Recipe recipe =
        app::parse_recipe(kSlit + "stop = \"bare(Si) > 0.9\"\nover_etch = 0.5\n", "over.toml");
    const test::Folder whole, parts;
    app::run_recipe(recipe, {.output = whole.path, .quiet = true});
    for (const double until : {2.0, 4.5}) {  // before and after the endpoint
        bool stop = false;
        const auto observe = [&](const app::Moment& moment) { stop = moment.state.time > until; };
        CHECK_THROWS_AS(app::run_recipe(recipe, {.output = parts.path,
                                                 .resume = true,
                                                 .quiet = true,
                                                 .stop = [&] { return stop; },
                                                 .observe = observe}),
                        Interrupted);
    }
    app::run_recipe(recipe, {.output = parts.path, .resume = true, .quiet = true});
    for (const char* name : {"timeline.csv", "surface.pvd", "surface_0001.vtp"})
        CHECK(test::read_bytes(parts.path / name) == test::read_bytes(whole.path / name));
    const auto steps = [](const test::Folder& folder) {
        return json::parse(test::read_bytes(folder.path / "summary.json"))["steps"];
    };
    CHECK(steps(parts) == steps(whole));
}

namespace {

// The recipe of the tutorial.
std::string tutorial_recipe() {
    const std::string text = test::read_bytes(SIDEWALL_SOURCE_DIR "/docs/tutorial.md");
    const std::string begin = "cat > contact.toml <<'END'\n";
    const std::size_t from = text.find(begin) + begin.size();
    return text.substr(from, text.find("END\n", from) - from);
}

// Share of columns within the resist's opening in which the saved interfaces have no oxide on the silicon.
double open_share(const levelset::MaterialStack& stack) {
    const double dx = stack.domain.spacing, radius = 0.5, h = radius / 50.0;
    const std::vector<TriangleMesh> interfaces =
        levelset::extract_materials(stack, levelset::extract_surface(stack)).interfaces;
    const surface::RayScene silicon(interfaces.at(0)), oxide(interfaces.at(1));
    int open = 0, all = 0;
    for (double x = -radius + 0.5 * h; x < radius; x += h)
        for (double y = -radius + 0.5 * h; y < radius; y += h) {
            if (x * x + y * y > radius * radius) continue;
            const Vec3 from(x, y, 5.0);
            const auto below = silicon.closest_hit(from, -Vec3::UnitZ(), 0.0, 1e30),
                       above = oxide.closest_hit(from, -Vec3::UnitZ(), 0.0, 1e30);
            ++all;
            if (below && above && below.distance - above.distance <= levelset::kExposed * dx) ++open;
        }
    return static_cast<double>(open) / all;
}

void check_contact(double spacing) {
    const app::Recipe recipe =
        app::parse_recipe(tutorial_recipe(), "contact.toml",
                          {"domain.grid_spacing=" + std::to_string(spacing), "flux.rays=5000"});
    const test::Folder folder;
    std::vector<std::string> layers;
    double share = 0.0;
    const auto observe = [&](const app::Moment& moment) {
        if (moment.summary == nullptr) return;
        for (const levelset::Layer& layer : moment.state.stack.layers)
            layers.push_back(recipe.materials[static_cast<std::size_t>(layer.material)].name);
        share = open_share(moment.state.stack);
    };
    app::run_recipe(recipe, {.output = folder.path, .quiet = true, .observe = observe});
    CHECK(layers == std::vector<std::string>{"Si", "SiO2", "TiN"});
    INFO(spacing);
    CHECK(share >= 0.95);  // the wall crosses the cells beside it
}

}  // namespace

TEST_CASE("the tutorial's contact is open: its liner lies on silicon over the floor") {
    check_contact(0.1);
}

TEST_CASE("the tutorial's contact is open on finer grids, too", "[slow]") {
    check_contact(0.05);
    check_contact(0.025);
}

TEST_CASE("the bare share of a round wafer's floor goes by area") {
    const json step = step_of(R"([domain]
extent = [1.5]
symmetry = "axial"
grid_spacing = 0.025
[[layer]]
material = "Si"
[[layer]]
material = "SiO2"
shape = "hole"
radius = 0.5
thickness = 0.2
[[layer]]
material = "Mask"
shape = "hole"
radius = 1.0
thickness = 0.3
[[step]]
model = "isotropic"
duration = 0.01
rate = { SiO2 = -0.1 }
stop_material = "Si"
)");
    CHECK(number(step["bare"]) == Approx(0.25).margin(0.01));  // (0.5 / 1.0)^2
}

TEST_CASE("a film is as thick beside a periodic side as in the middle") {
    const auto until = [](const std::string& x) {
        return number(step_of(R"([domain]
extent = [4.0]
grid_spacing = 0.05
boundary = "periodic"
[[layer]]
material = "Si"
[[layer]]
material = "SiO2"
shape = "fin"
width = 1.0
height = 1.0
position = [)" + x + R"(, 0.0]
[[step]]
model = "isotropic"
duration = 10.0
rate = 0.1
deposit = "Si3N4"
stop_thickness = 0.4
)")["duration"]);
    };
    CHECK(until("1.45") == Approx(until("0.0")).epsilon(1e-6));
}

TEST_CASE("an over-etch that is made whole late in a long process is said to be") {
    const std::string
        first = kEndpointStrip +
                "[[step]]\nmodel = \"directional\"\nduration = 90000.0\ndirectional = { Si = -1e-9 }\n",
        etch =
            "[[step]]\nmodel = \"directional\"\nduration = 1.0\ndirectional = { Si = -1.0 }\nover_etch = 0.001\nstop_depth = ";
    const std::string text = first + etch + "0.1\n" + etch + "0.2\n" + etch + "0.3\n";
    for (const std::size_t step : {1, 2, 3}) CHECK(step_of(text, step)["stopped_by"] == "stop_depth");
}

TEST_CASE("a law that names the time is of the scheme's order with a flux for every stage") {
    const json step = step_of(kEndpointStrip + R"([[step]]
model = "formula"
species = [{ name = "F" }]
duration = 1.0
rate = "-0.2 * F * time"
[flux]
stages = "all"
rays = 1000
[advection]
time_integration = "rk3"
)");
    CHECK(number(step["mean_rate"]) == Approx(-0.1).epsilon(1e-3));
}
