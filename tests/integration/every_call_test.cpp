#include <sstream>

#include "tests/integration/run_program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// A step that traces and one that does not, on a few cells; surfaces, interfaces, traced meshes, profiles.
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
    int copies = 0, refused = 0, done_without = 0;
    std::string report;
};

const std::string kRun = "'" SIDEWALL_FAULTS "' run recipe.toml --threads 1 --quiet -o out 2>&1 </dev/null";

// Runs the recipe in \p folder / "work" and copies what it leaves there, and a file of somebody else's, to
// "expected".
fs::path run_whole(const fs::path& folder) {
    const fs::path work = folder / "work";
    fs::create_directories(work / "out");
    std::ofstream(work / "recipe.toml") << kTiny;
    const Outcome first = run_command(work, kRun);
    INFO(first.output);
    REQUIRE(first.exit_code == 0);
    std::ofstream(work / "out/notes.txt") << "mine\n";
    fs::copy(work, folder / "expected", fs::copy_options::recursive);
    return work;
}

// Runs the recipe again over its result; each call on a file fails in a copy of the run
// (tests/faults/copies.cpp), which checks the outcome.
Ends fail_each_file_call() {
    const Folder folder;
    const fs::path work = run_whole(folder.path);
    REQUIRE(run_command(work, "SIDEWALL_FAULT='each 32' " + kRun).exit_code == 0);
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
    }
    const fs::path wrong = folder.path / "wrong.txt";
    INFO(ends.report);
    INFO(read_bytes(wrong));
    CHECK_FALSE(fs::exists(wrong));
    CHECK(ends.refused + ends.done_without == ends.copies);
    return ends;
}

}  // namespace

#ifndef SIDEWALL_SANITIZED  // sanitizers have allocators of their own

TEST_CASE("each call on a file that fails ends a run with a message and exit code 5, or changes nothing",
          "[slow]") {
    const Ends ends = fail_each_file_call();
    INFO(ends.report);
    CHECK(ends.copies > 150);
    CHECK(ends.refused > 100);
}

TEST_CASE("an allocation that fails ends a run with a message and exit code 4, files whole", "[slow]") {
    const Folder folder;
    const fs::path work = run_whole(folder.path), expected = folder.path / "expected";
    int refused = 0,
        unharmed = 0;  // libraries may do without some memory; after three in a row the run needs less
    for (long n = 1000; unharmed < 3; n += n / 4) {
        fs::remove_all(work / "out");
        fs::copy(expected / "out", work / "out", fs::copy_options::recursive);
        const Outcome outcome =
            run_command(work, "SIDEWALL_FAULT='memory " + std::to_string(n) + "' " + kRun);
        INFO("allocation " << n << ": " << outcome.output);
        if (outcome.exit_code == 0) {
            ++unharmed;
            continue;
        }
        unharmed = 0;
        ++refused;
        CHECK(outcome.exit_code == 4);
        CHECK(outcome.output.find("sidewall: out of memory: ") != std::string::npos);
        for (const auto& entry : fs::directory_iterator(work / "out")) {
            const fs::path name = entry.path().filename();
            const bool repeats =
                name.extension() == ".vtp" || name.extension() == ".toml" || name == "notes.txt";
            if (repeats) CHECK(read_bytes(entry.path()) == read_bytes(expected / "out" / name));
        }
    }
    CHECK(refused > 10);
}

#endif
