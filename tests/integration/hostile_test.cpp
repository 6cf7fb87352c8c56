#include <fmt/format.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/app/recipe/gds_bytes.hpp"
#include "tests/integration/run_program.hpp"

// Small files that ask for much, and surroundings that offer little: the program ends with a message.
namespace {

using sidewall::test::Folder;
using sidewall::test::Outcome;
using sidewall::test::run_command;
using sidewall::test::run_program;

const std::string kPlain =
    "[domain]\nextent = [4.0, 4.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n[[step]]\nmodel = "
    "\"isotropic\"\nduration = 1.0\nrate = -0.1\n";

std::string masked(const std::string& mask) {
    return kPlain + "[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\nthickness = 0.3\n" + mask;
}

void check_refused(const Outcome& outcome, int exit_code, const std::string& message) {
    INFO(outcome.output);
    CHECK(outcome.exit_code == exit_code);
    CHECK(outcome.output.starts_with("sidewall: "));
    CHECK(outcome.output.find(message) != std::string::npos);
    CHECK(outcome.output.size() < 1000);
}

}  // namespace

TEST_CASE("a key of 50,000 parts is refused, wherever it stands", "[foreign]") {
    const Folder folder;
    std::string key = "a";
    for (int k = 1; k < 50'000; ++k) key += ".a";
    for (const std::string& line : {key + " = 1\n", "[" + key + "]\n", "x = {" + key + " = 1}\n"}) {
        sidewall::test::write_bytes(folder.path / "deep.toml", kPlain + line);
        check_refused(run_program(folder.path, "check deep.toml"), 2, "deep.toml:10: a key of over 16 parts");
    }
    sidewall::test::write_bytes(folder.path / "good.toml", kPlain);
    check_refused(run_program(folder.path, "check good.toml --set " + key + "=1"), 2, "must be key=value");
    sidewall::test::write_bytes(folder.path / "text.toml", kPlain + "name = \"" + key + "\" # " + key + "\n");
    CHECK(run_program(folder.path, "check text.toml").exit_code == 0);
}

TEST_CASE("a suggestion is made only if it is close", "[foreign]") {
    const Folder folder;
    sidewall::test::write_bytes(folder.path / "good.toml", kPlain);
    const auto output = [&](const std::string& arguments) {
        return run_program(folder.path, arguments).output;
    };
    CHECK(output("check good.toml --set flux.ryas=100").find("did you mean rays?") != std::string::npos);
    CHECK(output("check good.toml --set layer[0].material=SIO2").find("did you mean SiO2?") !=
          std::string::npos);
    for (const char* far : {"check good.toml --set flux.xyzzy=1", "check good.toml --set zebra.a=1",
                            "check good.toml --set layer[0].material=unobtainium", "models frobnicate"}) {
        const std::string text = output(far);
        INFO(text);
        CHECK(text.starts_with("sidewall: "));
        CHECK(text.find("did you mean") == std::string::npos);
    }
    std::string name(1'000'000, 'x');
    sidewall::test::write_bytes(folder.path / "long.toml", kPlain + name + " = 1\n");
    check_refused(run_program(folder.path, "check long.toml"), 2, "long.toml:10: ");
}

TEST_CASE("a usage error is this program's, and names it", "[foreign]") {
    const Folder folder;
    for (const char* wrong : {"", "bogus", "check", "check a.toml --fast", "run --threads 0 a.toml"})
        CHECK(run_program(folder.path, wrong).output.starts_with("sidewall: "));
}

TEST_CASE("what a terminal would obey in a name is shown as its code", "[foreign]") {
    const Folder folder;
    const std::string clear = "'a\x1b[2J'";
    sidewall::test::write_bytes(folder.path / "good.toml", kPlain);
    sidewall::test::write_bytes(folder.path / "a\x1b[2J.toml", kPlain);  // progress shows its name
    for (const auto& [arguments, exit_code] : std::initializer_list<std::pair<std::string, int>>{
             {"run good.toml --set domain.grid_spacing=0.25 -o " + clear, 0},
             {"inspect " + clear, 0},
             {"export " + clear + " -o b" + clear + ".vtm", 0},
             {"export " + clear + " -o " + clear, 2},
             {"report " + clear + " -o " + clear + ".html", 0},
             {"render " + clear + ".vtp -o a.png", 3},
             {"run " + clear + ".toml --set domain.grid_spacing=0.25 -o c", 0},
             {"check 'b\x1b[2J.toml'", 3},
             {"check good.toml --set " + clear + "=1", 2},
             {"run --threads " + clear + " good.toml", 2},
             {"run good.toml --" + clear, 2},
             {"sweep good.toml --vary 'step[0].rate=-1,-2' -o " + clear + "2 --quiet --plan --jobs " + clear,
              2},
             {clear, 2}}) {
        const Outcome outcome = run_program(folder.path, arguments);
        INFO(outcome.output);
        CHECK(outcome.exit_code == exit_code);
        CHECK(outcome.output.find('\x1b') == std::string::npos);
        CHECK(outcome.output.find("\\x1b[2J") != std::string::npos);
    }
    // The commands of a plan hold no such character either, and name the same folder.
    const Outcome plan =
        run_program(folder.path, "sweep good.toml --vary 'step[0].rate=-1,-2' --plan -o " + clear + "3");
    REQUIRE(plan.exit_code == 0);
    CHECK(plan.output.find('\x1b') == std::string::npos);
    CHECK(
        run_command(folder.path, "sidewall() { '" SIDEWALL_PROGRAM "' \"$@\"; }\n" + plan.output).exit_code ==
        0);
    CHECK(std::filesystem::exists(folder.path / "a\x1b[2J3/runs/0002/summary.json"));
    check_refused(run_program(folder.path, "sweep good.toml --vary 'step[0].rate=-1,-2' --plan -o 'a\nb'"), 2,
                  "-o a\\x0ab: --plan prints a command a line");
}

TEST_CASE("a pipe is no mesh and no recipe", "[foreign]") {
    const Folder folder;
    for (const char* name : {"pipe.vtp", "pipe.toml"})
        REQUIRE(mkfifo((folder.path / name).c_str(), 0600) == 0);
    check_refused(run_program(folder.path, "inspect pipe.vtp"), 3, "pipe.vtp: is a pipe");
    check_refused(run_program(folder.path, "check pipe.toml"), 3, "pipe.toml: not a file");
    sidewall::test::write_bytes(folder.path / "mask.toml", masked("file = \"pipe.vtp\"\n"));
    check_refused(run_program(folder.path, "check mask.toml"), 2, "no such file");
}

TEST_CASE("faults of geometry name the mesh", "[foreign]") {
    const Folder folder;
    sidewall::test::write_bytes(folder.path / "odd.obj",
                                "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 1 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
    check_refused(run_program(folder.path, "simplify odd.obj -o out.vtp"), 3,
                  "odd.obj: edge between vertex 0");
    check_refused(run_program(folder.path, "flux odd.obj --boundary reflective"), 3, "odd.obj: ");
}

TEST_CASE("a standard error that takes no messages does not end the program", "[foreign]") {
    const Folder folder;
    sidewall::test::write_bytes(folder.path / "good.toml", kPlain);
    const auto exit_code = [&](const std::string& arguments) {
        const std::string command =
            "cd '" + folder.path.string() + "' && '" SIDEWALL_PROGRAM "' " + arguments;
        const int status = std::system(command.c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
    };
    for (const std::string closed : {" 2>&- >/dev/null", " 2>/dev/full >/dev/null"}) {
        CHECK(exit_code("check good.toml" + closed) == 0);
        CHECK(exit_code("check none.toml" + closed) == 3);
        CHECK(exit_code("bogus" + closed) == 2);
        CHECK(exit_code("run good.toml -o out --set step[0].duration=0.1" + closed) == 0);
    }
    CHECK(exit_code("check good.toml 2>/dev/null >&-") == 5);
    // A pipe whose reader has gone.
    const Outcome piped =
        run_command(folder.path, "( sleep 0.2; '" SIDEWALL_PROGRAM
                                 "' run good.toml -o piped --set step[0].duration=0.1; "
                                 "echo $? >code ) 2>&1 >/dev/null | true; exit $(cat code)");
    CHECK(piped.exit_code == 0);
}

#ifndef SIDEWALL_SANITIZED
// Least address space in MB for a start: below, the libraries fail to load before the program's first line.
int least_megabytes() {
    for (int megabytes = 100; megabytes < 1000; megabytes += 10)
        if (run_command(
                ".", fmt::format("ulimit -v {} && '" SIDEWALL_PROGRAM "' --version 2>&1", 1000 * megabytes))
                .exit_code == 0)
            return megabytes;
    return 1000;
}

TEST_CASE("under a limit of address space, messages speak of memory", "[foreign]") {
    const Folder folder;
    sidewall::test::write_bytes(folder.path / "good.toml", kPlain);
    const int least = least_megabytes();
    REQUIRE(least < 300);
    for (const int more : {0, 10, 30, 90}) {
        const Outcome outcome =
            run_command(folder.path, fmt::format("ulimit -v {} && '" SIDEWALL_PROGRAM
                                                 "' run good.toml --threads 16 -o out 2>&1 >/dev/null",
                                                 1000 * (least + more)));
        INFO(outcome.output);
        CHECK((outcome.exit_code == 4 || outcome.exit_code == 2 || outcome.exit_code == 0));
        if (outcome.exit_code != 0) CHECK(outcome.output.find("memory") != std::string::npos);
        CHECK(outcome.output.find("SSE2") == std::string::npos);
        CHECK(outcome.output.find("pthread") == std::string::npos);
    }
}
#endif

TEST_CASE("a mask of 100,000 polygons, each far too fine for the grid, is refused at once",
          "[foreign][slow]") {
    const Folder folder;
    constexpr int kRow = 317;
    std::string polygons = "polygons = [\n";
    for (int i = 0; i < 100'000; ++i) {
        const double x = -2.0 + 4.0 * (i % kRow) / kRow, y = -2.0 + 4.0 * (i / kRow) / kRow, s = 2.0 / kRow;
        char line[200];
        std::snprintf(line, sizeof line, "{points = [%.6f, %.6f, %.6f, %.6f, %.6f, %.6f]},\n", x, y, x + s, y,
                      x, y + s);
        polygons += line;
    }
    sidewall::test::write_bytes(folder.path / "mask.toml", masked(polygons + "]\n"));
    const Outcome outcome =
        run_program(folder.path, "run mask.toml -o out --set step[0].duration=0.1 --quiet", 200);
    INFO(outcome.output);
    CHECK(outcome.exit_code == 2);
    CHECK(outcome.output.find("use a grid_spacing of") != std::string::npos);
}
