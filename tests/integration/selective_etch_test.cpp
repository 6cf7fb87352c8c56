#include "app/process/simulation.hpp"
#include "surface/files/mesh_io.hpp"
#include "tests/integration/run_program.hpp"

// Selective etch of silicon-germanium, whose coverages are carried from time step to time step.
using namespace sidewall;
using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

const std::string kSelective = "'" SIDEWALL_SOURCE_DIR "/configs/quick/sige_selective_etch.toml'";
const std::string kSmall = " --quiet --set flux.rays=2000 --set output.every=1.0 ";

}  // namespace

TEST_CASE("a selective etch is the same on one thread and two, and when it is resumed in the middle") {
    const Folder folder;
    const auto go = [&](const std::string& arguments) {
        const Outcome outcome = run_program(folder.path, "run " + kSelective + kSmall + arguments);
        CAPTURE(outcome.output);
        CHECK(outcome.exit_code == 0);
    };
    go("-o one --threads 1");
    go("-o two --threads 2");
    const std::string last = read_bytes(folder.path / "one" / "surface_0004.vtp");
    CHECK(last.size() > 1000);
    CHECK(read_bytes(folder.path / "two" / "surface_0004.vtp") == last);
    // The run is stopped after the first second of four.
    const Outcome stopped =
        run_with_fault(folder.path, "kill 240", "run " + kSelective + kSmall + "-o three");
    CHECK(stopped.exit_code != 0);
    CHECK(fs::exists(folder.path / "three" / "checkpoint.vdb"));
    CHECK_FALSE(fs::exists(folder.path / "three" / "summary.json"));
    CHECK(last_time(folder.path / "three") >= 1.0);
    go("-o three --resume");
    CHECK(read_bytes(folder.path / "three" / "surface_0004.vtp") == last);
}

TEST_CASE("silicon-germanium recedes between silicon that stays, and check tells what a gas costs") {
    const Folder folder;
    const app::Recipe recipe = app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/sige_selective_etch.toml",
                                                {"step[1].duration=2.0"});
    const auto run = app::run_recipe(recipe, {.output = folder.path / "out", .quiet = true});
    const auto& figures = run.summary["metrology"];
    // Two seconds at most at the open wafer's 9.75 nm/s; silicon loses 400 times less there.
    const double recess = figures["recess_SiGe"].get<double>();
    CHECK(recess > 4.0);
    CHECK(recess < 2.0 * 9.75);
    // The trench's floor is silicon.
    CHECK(figures["depth"].get<double>() == Approx(100.0).margin(0.5));
    const auto checked =
        run_program(folder.path, "check '" SIDEWALL_SOURCE_DIR
                                 "/configs/quick/apcvd_trench.toml' --set flux.method=radiosity");
    CHECK(checked.exit_code == 0);
    CHECK(checked.output.find("neutral by monte-carlo (its particles collide in the gas)") !=
          std::string::npos);
}
