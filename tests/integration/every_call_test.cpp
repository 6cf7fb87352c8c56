#include <cstdlib>
#include <sstream>

#include "tests/integration/program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// A step that traces and one that does not, on a few cells; surfaces, interfaces, traced meshes and profiles.
const std::string kTiny = R"([domain]
extent = [1.0, 0.5]
grid_spacing = 0.125
[[layer]]
material = "Si"
shape = "trench"
width = 0.5
depth = 0.25
[[step]]
model = "single_particle"
rate = 1.0
sticking = 0.5
duration = 0.1
deposit = "SiO2"
[[step]]
model = "isotropic"
rate = -1.0
duration = 0.1
[flux]
rays = 500
[output]
profiles = ["y=0"]
)";

struct Ends {
    int copies = 0, refused = 0, done_without = 0, in_library = 0;
    std::string report;
};

// Runs the recipe in a folder that holds its earlier result, and a file of somebody else's; each call of the
// kind fails in a copy (tests/faults/copies.cpp), which judges what came of it.
Ends fail_each(const std::string& what) {
    const Folder folder;
    const fs::path work = folder.path / "work";
    fs::create_directories(work / "out");
    std::ofstream(work / "recipe.toml") << kTiny;
    const std::string run =
        "'" SIDEWALL_FAULTS "' run recipe.toml --threads 1 --quiet -o out 2>&1 </dev/null";
    const Outcome first = run_command(work, run);
    INFO(first.output);
    REQUIRE(first.exit_code == 0);
    std::ofstream(work / "out/notes.txt") << "mine\n";
    fs::copy(work, folder.path / "expected", fs::copy_options::recursive);
    REQUIRE(run_command(work, "SIDEWALL_FAULT='each " + what + "' " + run).exit_code == 0);
    Ends ends;
    ends.report = read_bytes(folder.path / "report.txt");
    std::istringstream lines(ends.report);
    lines >> ends.copies;
    for (std::string line; std::getline(lines, line);) {
        int count = 0;
        std::string end;
        std::istringstream words(line);
        if (!(words >> count >> end)) continue;
        if (end == "exit") ends.refused += count;
        if (end == "does") ends.done_without += count;
        if (end == "ended") ends.in_library += count;
    }
    const fs::path wrong = folder.path / "wrong.txt";
    INFO(ends.report);
    INFO(read_bytes(wrong));
    CHECK_FALSE(fs::exists(wrong));
    CHECK(ends.refused + ends.done_without + ends.in_library == ends.copies);
    return ends;
}

}  // namespace

#ifndef SIDEWALL_SANITIZED  // sanitizers have allocators of their own

TEST_CASE("each call on a file that fails ends a run with a message and exit code 5, or changes nothing",
          "[slow]") {
    const Ends ends = fail_each("file 32 1");
    INFO(ends.report);
    CHECK(ends.copies > 150);
    CHECK(ends.refused > 100);
    CHECK(ends.in_library == 0);
}

// One chain of callers in twelve; of all: SIDEWALL_FAULT_STRIDE=1 build/release/tests/integration_tests "each
// allocation*"
TEST_CASE("each allocation that fails ends a run with a message and exit code 4, files whole", "[slow]") {
    const char* stride = std::getenv("SIDEWALL_FAULT_STRIDE");
    const Ends ends = fail_each(std::string("memory 16 ") + (stride == nullptr ? "12" : stride));
    WARN(ends.report);
    CHECK(ends.copies > 300);
    CHECK(ends.refused > 9 * ends.copies / 10);
    CHECK(ends.in_library <= 1 + ends.copies / 500);
}

#endif
