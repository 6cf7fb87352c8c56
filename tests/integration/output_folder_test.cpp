#include <sys/stat.h>

#include <fstream>

#include "app/common/text.hpp"
#include "tests/integration/run_program.hpp"

// Contents of, and changes to, the folder that a run writes to.
namespace {

using namespace sidewall;
namespace fs = std::filesystem;

const std::string kFlat =
    "[domain]\nextent = [2.0, 0.4]\ngrid_spacing = 0.1\nboundary = [\"reflective\", \"periodic\"]\n"
    "[[layer]]\nmaterial = \"Si\"\n[[step]]\nmodel = \"isotropic\"\nduration = 0.5\nrate = -0.2\n";

}  // namespace

TEST_CASE("a trial with --set and without -o has a folder of its own, and asks nothing when it is repeated") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    const auto run = [&](const std::string& rest) {
        const auto outcome = test::run_program(folder.path, "run flat.toml --quiet" + rest, 30);
        INFO(rest << ": " << outcome.output);
        CHECK(outcome.exit_code == 0);
    };
    const fs::path results = folder.path / "results";
    run("");
    for (const char* trial : {" --set 'step[0].duration=0.2'", " --set 'step[0].duration=0.3'",
                              " --set 'step[0].duration=0.2'", ""})
        run(trial);
    CHECK(fs::exists(results / "flat" / "summary.json"));
    CHECK(fs::exists(results / "flat,step.0.duration=0.2" / "summary.json"));
    CHECK(fs::exists(results / "flat,step.0.duration=0.3" / "summary.json"));
    // A resumed run stays in its folder, also with a changed setting.
    run(" --resume --set 'step[0].duration=0.7'");
    CHECK_FALSE(fs::exists(results / "flat,step.0.duration=0.7"));
    std::string longest;
    for (int k = 0; k < 12; ++k)
        longest += " --set 'step[0].name=\"a name of many letters " + std::to_string(k) + "\"'";
    run(longest);
    run(longest + " --set 'step[0].duration=0.1'");
    CHECK(std::distance(fs::directory_iterator(results), {}) == 5);
}

TEST_CASE("a strip takes several materials and warns of those that are buried or absent") {
    const test::Folder folder;
    test::write_bytes(
        folder.path / "strip.toml",
        "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n"
        "[[layer]]\nmaterial = \"Resist\"\nthickness = 0.4\n[[layer]]\nmaterial = \"SiO2\"\nthickness = 0.4\n"
        "[[step]]\nmodel = \"strip\"\nmaterial = [\"Resist\", \"W\"]\n"
        "[[step]]\nmodel = \"strip\"\nmaterial = \"oxide\"\n");
    const auto run = test::run_program(folder.path, "run strip.toml", 30);
    INFO(run.output);
    CHECK(run.exit_code == 0);
    CHECK(run.output.find("step 1 (1 strip): there is no W on the wafer to strip; Resist is buried") !=
          std::string::npos);
    CHECK(run.output.find("step 2 (") == std::string::npos);
    CHECK(run.output.find("oxide is taken as the built-in SiO2") != std::string::npos);
}

TEST_CASE("a link, a device or a pipe among a run's files is refused before anything runs", "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    const std::string name = GENERATE(as<std::string>(), ".sidewall.lock", "recipe.toml", "manifest.txt",
                                      "timeline.csv", "surface.pvd", "checkpoint.vdb");
    CAPTURE(name);
    const fs::path there = folder.path / "out" / name;
    for (const char* option : {"", " --overwrite", " --resume"}) {
        CAPTURE(option);
        for (const bool pipe : {false, true}) {
            fs::remove_all(folder.path / "out");
            fs::create_directory(folder.path / "out");
            test::write_bytes(folder.path / "precious", "precious");
            if (pipe)
                REQUIRE(::mkfifo(there.c_str(), 0600) == 0);
            else
                fs::create_symlink("../precious", there);
            const auto run = test::run_program(folder.path, std::string("run flat.toml -o out") + option, 5);
            INFO(run.output);
            CHECK(run.exit_code == 5);
            CHECK(run.output.find("out/" + name + ": cannot write: is a ") != std::string::npos);
            CHECK(test::read_bytes(folder.path / "precious") == "precious");
            CHECK(fs::directory_entry(there).is_symlink() != pipe);
        }
    }
}

TEST_CASE(
    "a link in place of a folder that the program has for itself is refused, and nothing is written beyond it") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    const auto [link, command] = GENERATE(table<const char*, const char*>(
        {{"out/runs", "sweep flat.toml --quiet --vary step[0].rate=-0.1,-0.3"},
         {"out/runs/0002", "sweep flat.toml --quiet --vary step[0].rate=-0.1,-0.3"},
         {"out/none", "compare flat.toml"},
         {"out/accuracy", "run flat.toml --quiet --accuracy depth=5%"}}));
    CAPTURE(link);
    const bool is_sweep = std::string(command).starts_with("sweep");
    if (is_sweep)
        REQUIRE(test::run_program(folder.path, std::string(command) + " -o out", 60).exit_code == 0);
    fs::create_directories((folder.path / link).parent_path());
    fs::remove_all(folder.path / link);
    fs::create_directory(folder.path / "elsewhere");
    fs::create_directory_symlink(folder.path / "elsewhere", folder.path / link);
    const auto run =
        test::run_program(folder.path, std::string(command) + " -o out" + (is_sweep ? " --resume" : ""), 60);
    INFO(run.output);
    CHECK(run.exit_code == 5);
    CHECK(run.output.find(std::string(link) + ": is a link") != std::string::npos);
    CHECK(fs::is_empty(folder.path / "elsewhere"));
}

TEST_CASE("a folder that is emptied, removed, renamed or replaced during a run ends it with exit code 5",
          "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat + "[output]\nevery = 0.0005\n");
    const std::string change = GENERATE(as<std::string>(), "rm -rf out/*", "mv out moved && rm -rf moved",
                                        "mv out moved", "mv out moved; mkdir out");
    CAPTURE(change);
    const auto run = test::run_command(
        folder.path,
        "{ ( timeout 60 '" SIDEWALL_PROGRAM
        "' run flat.toml -o out --quiet 2>&1; echo \"exit $?\" ) & "
        "p=$!; until [ -e out/surface_0003.vtp ] || ! kill -0 $p 2>/dev/null; do sleep 0.01; done; " +
            change + "; wait; }");
    INFO(run.output);
    CHECK(run.output.find("exit 5") != std::string::npos);
    CHECK_FALSE(fs::exists(folder.path / "out/summary.json"));
    CHECK_FALSE(fs::exists(folder.path / "out/recipe.toml"));
}

namespace {

/// A run of kFlat with 41 saved surfaces in the folder run, killed after the 13th.
const std::string kSaving = kFlat + "[output]\nevery = 0.0125\n";

void kill_a_run(const test::Folder& folder) {
    test::write_bytes(folder.path / "flat.toml", kSaving);
    test::run_command(
        folder.path,
        "{ '" SIDEWALL_PROGRAM
        "' run flat.toml -o run --quiet >/dev/null 2>&1 & "
        "p=$!; until [ -e run/surface_0012.vtp ] || ! kill -0 $p 2>/dev/null; do sleep 0.002; done; "
        "kill -9 $p; wait; }");
    REQUIRE_FALSE(fs::exists(folder.path / "run/summary.json"));
}

}  // namespace

TEST_CASE(
    "a byte of the timeline or the manifest that changed before a run goes on, or after its end, is noticed",
    "[slow]") {
    const test::Folder folder;
    kill_a_run(folder);
    if (GENERATE(false, true))
        REQUIRE(test::run_program(folder.path, "run flat.toml -o run --resume --quiet").exit_code == 0);
    for (const char* name : {"timeline.csv", "manifest.txt"})
        for (const double place : {0.1, 0.3, 0.5}) {
            CAPTURE(name, place);
            fs::remove_all(folder.path / "out");
            fs::copy(folder.path / "run", folder.path / "out");
            std::string bytes = test::read_bytes(folder.path / "out" / name);
            bytes[static_cast<std::size_t>(place * static_cast<double>(bytes.size()))] ^= 1;
            test::write_bytes(folder.path / "out" / name, bytes);
            const auto run = test::run_program(folder.path, "run flat.toml -o out --resume --quiet");
            INFO(run.output);
            CHECK(run.exit_code == 3);
            CHECK(
                run.output.starts_with(std::string("sidewall: out/") + name + ": is not what the run wrote"));
            CHECK(test::read_bytes(folder.path / "out" / name) == bytes);
            if (place < 0.5) continue;
            // Without the damaged file the run resumes.
            fs::remove(folder.path / "out" / name);
            CHECK(test::run_program(folder.path, "run flat.toml -o out --resume --quiet").exit_code == 0);
        }
}

TEST_CASE("a run that is killed while it goes on goes on again, to the same timeline", "[slow]") {
    const test::Folder folder;
    kill_a_run(folder);
    for (const char* fault : {"kill 7", "kill 25", "kill 60", "kill 110"}) {
        const auto killed = test::run_with_fault(folder.path, fault, "run flat.toml -o run --resume --quiet");
        CAPTURE(fault, killed.output);
        CHECK(killed.exit_code == 137);
    }
    REQUIRE(test::run_program(folder.path, "run flat.toml -o run --resume --quiet").exit_code == 0);
    REQUIRE(test::run_program(folder.path, "run flat.toml -o whole --quiet").exit_code == 0);
    CHECK(test::read_bytes(folder.path / "run/timeline.csv") ==
          test::read_bytes(folder.path / "whole/timeline.csv"));
    CHECK(test::read_bytes(folder.path / "run/manifest.txt").size() > 41 * 16);
}

TEST_CASE("to resume where nothing began is to begin") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    fs::create_directory(folder.path / "empty");
    for (const char* out : {"none", "empty", "a/b"}) {
        CAPTURE(out);
        const auto run =
            test::run_program(folder.path, std::string("run flat.toml --quiet --resume -o ") + out);
        INFO(run.output);
        CHECK(run.exit_code == 0);
        CHECK(fs::exists(folder.path / out / "summary.json"));
    }
    const std::string sweep = "sweep flat.toml --quiet --resume -o sweep --vary 'step[0].rate=-0.1,-0.3'";
    CHECK(test::run_program(folder.path, sweep).exit_code == 0);
}

TEST_CASE("a fit stops at the first run that the disk refuses, and goes on to the result it would have had",
          "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    const std::string fit =
        "fit flat.toml --quiet --jobs 1 --vary 'step[0].rate=-0.4:-0.1' --target depth=0.1234 --resume -o ";
    REQUIRE(test::run_program(folder.path, fit + "whole", 60).exit_code == 0);
    for (const char* fault : {"full 40", "full 52", "full 64"}) {  // each run counts its own operations
        fs::remove_all(folder.path / "out");
        const auto full = test::run_with_fault(folder.path, fault, fit + "out", 60);
        INFO(fault << full.output);
        CHECK(full.exit_code == 5);
        CHECK(full.output.find("run 0001: ") != std::string::npos);
        CHECK(full.output.find("No space left on device") != std::string::npos);
        CHECK(test::count(full.output, "go on with: ") == 1);
        CHECK_FALSE(fs::exists(folder.path / "out/runs/0003"));
        REQUIRE(test::run_program(folder.path, fit + "out", 60).exit_code == 0);
        for (const char* name : {"fit.json", "best.toml"})
            CHECK(test::read_bytes(folder.path / "out" / name) ==
                  test::read_bytes(folder.path / "whole" / name));
    }
}

TEST_CASE("a planned command is one line, whatever the folder is called, and a leading dash makes no option",
          "[slow]") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    const std::string vary = " --vary 'step[0].rate=-0.1,-0.3'";
    const auto broken = test::run_program(
        folder.path, "sweep flat.toml --plan --output=\"$(printf 'nl\\ntouch PWN\\nx')\"" + vary);
    CHECK(broken.exit_code == 2);
    CHECK(broken.output.find("line break") != std::string::npos);
    CHECK_FALSE(fs::exists(folder.path / "nl\ntouch PWN\nx"));
    for (const std::string name : {"-d", "--help", "it's $(touch PWN); \"x\""}) {
        CAPTURE(name);
        const std::string output = "--output=" + app::shell_word(name);
        const auto plan = test::run_program(folder.path, "sweep flat.toml --plan " + output + vary);
        INFO(plan.output);
        REQUIRE(plan.exit_code == 0);
        test::write_bytes(folder.path / "plan.txt", plan.output);
        const auto made = test::run_command(
            folder.path, "sidewall() { '" SIDEWALL_PROGRAM
                         "' \"$@\"; }; while read -r line; do eval \"$line\" || exit 1; done <plan.txt");
        INFO(made.output);
        CHECK(made.exit_code == 0);
        CHECK(test::run_program(folder.path, "sweep flat.toml --resume --quiet " + output + vary).exit_code ==
              0);
        CHECK(test::count(test::read_bytes(folder.path / name / "sweep.csv"), ",ok\n") == 2);
        CHECK(test::run_program(folder.path, "sweep flat.toml --quiet " + output + "2" + vary).exit_code ==
              0);
    }
    CHECK_FALSE(fs::exists(folder.path / "PWN"));
}

TEST_CASE("where few threads are allowed the program says so, and where it may not write it says that") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    fs::permissions(folder.path, fs::perms::all);
    fs::create_directory(folder.path / "closed");
    fs::permissions(folder.path / "closed", fs::perms(0555));
    // Permissions do not bind root: another user runs the program.
    const std::string user = ::geteuid() == 0 ? "setpriv --reuid=65534 --clear-groups " : "";
    if (test::run_command(folder.path, user + "'" SIDEWALL_PROGRAM "' --version >/dev/null 2>&1").exit_code !=
        0) {
        WARN("another user cannot run the program here: not tried");
        return;
    }
    for (const char* command :
         {"run flat.toml -o out", "sweep flat.toml -o out --vary 'step[0].rate=-0.1,-0.3'",
          "check flat.toml --no-estimate"})
        for (const char* most : {"1", "3"}) {
            CAPTURE(command, most);
            const auto few =
                test::run_command(folder.path, user + "prlimit --nproc=" + most + ":" + most +
                                                   " '" SIDEWALL_PROGRAM "' " + command + " 2>&1");
            INFO(few.output);
            CHECK(few.exit_code == 4);
            CHECK(few.output.find("sidewall: cannot start a thread") == 0);
        }
    for (const char* out : {"closed", "closed/sub"}) {
        const auto run = test::run_command(
            folder.path, user + "'" SIDEWALL_PROGRAM "' run flat.toml --quiet -o " + out + " 2>&1");
        INFO(run.output);
        CHECK(run.exit_code == 5);
        CHECK(run.output.find("Permission denied") != std::string::npos);
    }
}

TEST_CASE("a sweep needs no /proc") {
    const test::Folder folder;
    test::write_bytes(folder.path / "flat.toml", kFlat);
    const std::string hidden = "unshare -m sh -c 'mount -t tmpfs none /proc && ";
    if (test::run_command(folder.path, hidden + "true' 2>/dev/null").exit_code != 0) {
        WARN("/proc cannot be hidden here: not tried");
        return;
    }
    const auto sweep = test::run_command(
        folder.path, hidden + "\"" SIDEWALL_PROGRAM
                              "\" sweep flat.toml -o out --quiet --vary step[0].rate=-0.1,-0.3' 2>&1");
    INFO(sweep.output);
    CHECK(sweep.exit_code == 0);
    CHECK(test::count(test::read_bytes(folder.path / "out/sweep.csv"), ",ok\n") == 2);
}
