#include <nlohmann/json.hpp>

#include "app/process/simulation.hpp"
#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"
#include "tests/restated.hpp"

// Models written as formulas: equal to the built-in ones, on any number of threads and when resumed.
using namespace sidewall;
using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

TriangleMesh run(const Folder& folder, const std::string& recipe, const std::string& output) {
    app::RunOptions options;
    options.output = folder.path / output;
    options.quiet = true;
    return app::run_recipe(app::parse_recipe(recipe, "recipe.toml"), options).surface;
}

// Largest distance between two surfaces, in grid spacings.
double apart(const TriangleMesh& one, const TriangleMesh& other, double spacing) {
    return surface::two_sided_distance(one, other).max / spacing;
}

// Coverages that take time, a rate that changes with time, depth and place, and ions whose incidence counts.
const std::string kSlow = R"TOML([domain]
extent = [2.0, 0.4]
grid_spacing = 0.1
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 0.5
[[step]]
model = "formula"
duration = 1.0
time_steps = 12
species = [{ name = "F", sticking = "0.5*(1 - theta)" }, { name = "ion", kind = "ion" }]
coverage_rates = { theta = "3*F*(1 - theta) - 0.5*theta - bare*ion" }
coverages = { bare = "1 - theta" }
rate = { Si = "-0.2*theta*ion*cos - 0.05*(time < 0.5 ? F : 0)*exp(-depth) - 0.01*(x > 0)" }
[flux]
rays = 500
)TOML";

}  // namespace

TEST_CASE("sf6_o2 and teos written as formulas make the built-in models' profiles to a thousandth of a cell",
          "[slow]") {
    const Folder folder;
    const std::string own =
        read_bytes(fs::path(SIDEWALL_SOURCE_DIR) / "configs" / "quick" / "teos_trench.toml");
    CHECK(apart(run(folder, own, "own"), run(folder, restated("teos_trench.toml", kTeos), "formula"), 0.125) <
          1e-3);
    const std::string etch =
        read_bytes(fs::path(SIDEWALL_SOURCE_DIR) / "configs" / "quick" / "sf6o2_hole.toml");
    CHECK(apart(run(folder, etch, "own2"), run(folder, restated("sf6o2_hole.toml", kSf6), "formula2"),
                0.0625) < 1e-3);
}

TEST_CASE("a formula step is the same on one thread and two, and when it is resumed in the middle") {
    const Folder folder;
    std::ofstream(folder.path / "slow.toml") << kSlow;
    const auto go = [&](const std::string& arguments) {
        const Outcome outcome = run_program(folder.path, "run slow.toml " + arguments);
        CAPTURE(outcome.output);
        CHECK(outcome.exit_code == 0);
    };
    go("-o one --threads 1");
    go("-o two --threads 2");
    const std::string surface = read_bytes(folder.path / "one" / "surface_0001.vtp");
    CHECK(surface.size() > 1000);
    CHECK(read_bytes(folder.path / "two" / "surface_0001.vtp") == surface);
    // The run is stopped in the second quarter.
    const Outcome stopped =
        run_with_fault(folder.path, "kill 120", "run slow.toml -o three --set output.every=0.25");
    CHECK(stopped.exit_code != 0);
    CHECK(fs::exists(folder.path / "three" / "checkpoint.vdb"));
    CHECK_FALSE(fs::exists(folder.path / "three" / "summary.json"));
    CHECK(last_time(folder.path / "three") >= 0.25);
    go("-o three --set output.every=0.25 --resume");
    go("-o four --set output.every=0.25");
    const std::string last = read_bytes(folder.path / "four" / "surface_0004.vtp");
    CHECK(last.size() > 1000);
    CHECK(read_bytes(folder.path / "three" / "surface_0004.vtp") == last);
}

TEST_CASE("a coverage with a rate follows its closed form on a flat wafer while the wafer is etched") {
    // theta = 1 - exp(-2 t): the depth after t is 0.1 (t - (1 - exp(-2 t))/2), to first order in the time
    // step.
    const Folder folder;
    const std::string recipe = R"TOML([domain]
extent = [0.4, 0.4]
grid_spacing = 0.1
boundary = "periodic"
[[layer]]
material = "Si"
[[step]]
model = "formula"
duration = 1.0
time_steps = 200
species = [{ name = "F" }]
coverage_rates = { theta = "2*(1 - theta)" }
rate = "-0.1*theta"
[flux]
rays = 100
[simplify]
method = "none"
)TOML";
    const TriangleMesh surface = run(folder, recipe, "flat");
    const double exact = 0.1 * (1.0 - 0.5 * (1.0 - std::exp(-2.0)));
    double lowest = 0.0;
    for (const Vec3& p : surface.vertices) lowest = std::min(lowest, p.z());
    // Speeds are those at the start of each of 200 time steps: they lag by dt/2 of the change of theta.
    CHECK(-lowest == Approx(exact).margin(0.1 * 0.5 / 200.0 * (1.0 - std::exp(-2.0)) * 1.05 + 2e-5));
}

TEST_CASE("a law that has no value ends the run with its expression, the material and the values") {
    const Folder folder;
    std::ofstream(folder.path / "bad.toml") << R"TOML([domain]
extent = [1.0, 1.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
[[step]]
model = "formula"
duration = 1.0
rate = { Si = "-sqrt(0.05 - depth)" }
)TOML";
    const Outcome outcome = run_program(folder.path, "run bad.toml -o out");
    CAPTURE(outcome.output);
    CHECK(outcome.exit_code == 4);
    CHECK(outcome.output.find("rate.Si = \"-sqrt(0.05 - depth)\" is not a number on Si at (") !=
          std::string::npos);
    CHECK(outcome.output.find("where depth = 0.") != std::string::npos);
    const Outcome unknown = run_program(folder.path, "run bad.toml -o out --set 'step[0].rate=\"-dept\"'");
    CHECK(unknown.exit_code == 2);
    CHECK(unknown.output.find("unknown name dept; did you mean depth?") != std::string::npos);
}
