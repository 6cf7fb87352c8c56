#include "app/process/estimate/estimate.hpp"

#include <sys/resource.h>

#include <nlohmann/json.hpp>

#include "tests/integration/run_program.hpp"

using namespace sidewall;
using namespace sidewall::test;

namespace {

struct Real {
    double time_steps = 0.0, rays = 0.0, memory = 0.0;
};

// Cost of a run of the program: rays of a trace times traces, and peak resident memory.
Real real_run(const std::filesystem::path& folder, const std::string& arguments) {
    const auto outcome = run_program(folder, "run " + arguments + " --quiet -o out", 120);
    INFO(outcome.output);
    REQUIRE(outcome.exit_code == 0);
    const auto summary = nlohmann::json::parse(read_bytes(folder / "out" / "summary.json"));
    Real real{.time_steps = summary["time_steps"].get<double>()};
    double rays = 0.0;
    for (const auto& species : summary["flux"]) rays += species["rays"].get<double>();
    real.rays = rays * (real.time_steps + 1.0);
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    real.memory = 1024.0 * static_cast<double>(used.ru_maxrss);
    return real;
}

void check_within_two(double estimate, double real) {
    CHECK(estimate <= 2.0 * real);
    CHECK(estimate >= 0.5 * real);
}

}  // namespace

TEST_CASE("what a run takes in time steps and rays and memory is estimated to a factor of two", "[slow]") {
    const std::vector<std::pair<std::string, std::vector<std::string>>> rows = {
        {"trench_deposition", {"flux.rays=20000"}},           // one step
        {"trench_deposition", {"flux.relative_error=0.03"}},  // rays by the error
        {"trench_deposition",
         {"flux.rays=20000", "flux.stages=all", "advection.time_integration=rk2"}},  // a trace at every stage
        {"deposit_and_etch", {}},  // a loop that etches what it has deposited
        {"gds_masked_etch", {}},   // a stop condition
        {"fin_sequence", {}},      // steps that take no time
        {"sputter_facet", {}},     // ions
    };
    for (const auto& [name, overrides] : rows) {
        const Folder folder;
        std::string arguments = config("quick/" + name + ".toml");
        for (const std::string& setting : overrides) arguments += " --set " + setting;
        const Real real = real_run(folder.path, arguments);
        // The effort suffices for all rays, so that the machine's speed does not matter.
        const app::Estimate estimate = app::estimate_run(
            app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name + ".toml", overrides), 1e3);
        CAPTURE(name, overrides, estimate.time_steps, real.time_steps, estimate.rays, real.rays,
                estimate.memory, real.memory);
        check_within_two(estimate.time_steps, real.time_steps);
        const double stages = overrides.size() == 3 ? 2.0 : 1.0;
        check_within_two(estimate.rays, stages * real.rays);
        check_within_two(estimate.memory, real.memory);
        CHECK(estimate.seconds > 0.0);
    }
}

TEST_CASE("a profile's exchange without noise is estimated as what the run takes: no rays") {
    const app::Estimate estimate =
        app::estimate_run(app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/trench_profile.toml"));
    CHECK(estimate.rays == 0.0);
    REQUIRE(estimate.methods.size() == 1);
    CHECK_THAT(estimate.methods.front(), Catch::Contains("a profile's exchange has no noise"));
}

TEST_CASE("an estimate says if radiosity's rays do not reach the relative error asked for") {
    const auto short_of = [](const std::string& error) {
        return app::estimate_run(app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/ald_hole.toml",
                                                  {"flux.method=radiosity", "flux.max_rays=100000",
                                                   "flux.relative_error=" + error}))
            .short_of;
    };
    const std::vector<std::string> notes = short_of("0.0001");
    REQUIRE(notes.size() == 1);
    CHECK_THAT(notes.front(),
               Catch::StartsWith("precursor: the rays allowed (flux.memory = 2, flux.max_rays = 100000)") &&
                   Catch::EndsWith("not the 0.0001 asked for"));
    CHECK(short_of("0.2").empty());
}

TEST_CASE("a wafer that takes too long to build is not built for an estimate, which says so") {
    const std::string in_space = "domain.strip=\"space\"";
    const app::Recipe recipe =
        app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/oxide_nitride_stack.toml", {in_space});
    const app::Estimate refused = app::estimate_run(recipe, 1.0, 1e-9);
    CHECK_FALSE(refused.known);
    CHECK(refused.building > 0.0);
    CHECK(refused.memory > 0.0);
    CHECK(refused.seconds == 0.0);
    // The time to build a wafer is proportional to cells and layers.
    const auto building = [](const std::vector<std::string>& overrides) {
        return app::estimate_run(
                   app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/oxide_nitride_stack.toml", overrides),
                   1.0, 1e-9)
            .building;
    };
    CHECK(building({in_space, "domain.grid_spacing=2.5"}) == Approx(4.0 * refused.building));
    CHECK(building({in_space, "layer[1].repeat=4"}) == Approx(10.0 / 8.0 * refused.building));
}

TEST_CASE("check prints a recipe that it accepts again, and what a run takes as comments", "[foreign]") {
    const Folder folder;
    const auto recipe = config("quick/isotropic_deposition.toml");
    const auto checked = run_program(folder.path, "check " + recipe);
    REQUIRE(checked.exit_code == 0);
    for (const char* line :
         {"\n#   time steps 6\n", "\n#   rays       0\n", "\n#   memory ", "\n#   wall time "})
        CHECK(checked.output.find(line) != std::string::npos);
    std::ofstream(folder.path / "again.toml") << checked.output;
    const auto without = run_program(folder.path, "check again.toml --no-estimate");
    CHECK(without.exit_code == 0);
    CHECK(checked.output.starts_with(without.output));
    CHECK(without.output.find("wall time") == std::string::npos);
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path), {}) == 1);
}
