#include <sys/resource.h>
#include <sys/wait.h>

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "tests/integration/run_program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// A run of a tenth of a second that saves three surfaces.
const std::string kQuick = R"([domain]
extent = [1.2, 1.0]
grid_spacing = 0.1
[[layer]]
material = "Si"
shape = "trench"
width = 0.6
depth = 0.5
[[step]]
model = "isotropic"
duration = 0.5
rate = -0.1
[[step]]
model = "isotropic"
duration = 0.5
rate = 0.1
deposit = "SiO2"
[output]
every = 0.5
)";

#ifdef SIDEWALL_SANITIZED
constexpr bool kFullSpeed = false;
#else
constexpr bool kFullSpeed = true;
#endif

using Files = std::map<std::string, std::string>;

Files files_in(const fs::path& folder) {
    Files files;
    for (const auto& entry : fs::directory_iterator(folder))
        files[entry.path().filename().string()] = read_bytes(entry.path());
    return files;
}

// Whether a file has the same bytes in every run: it holds no seconds and no place of resuming.
bool repeats(const std::string& name) {
    return name.ends_with(".vtp") || name.ends_with(".toml");
}

// Checks that all expected files are there, with their bytes where these are the same in every run.
void check_holds(const Files& folder, const Files& expected) {
    for (const auto& [name, bytes] : expected) {
        CAPTURE(name);
        REQUIRE(folder.count(name) == 1);
        if (repeats(name)) CHECK(folder.at(name) == bytes);
    }
}

// Checks that a failed run has left whole files and whole rows only.
void check_whole(const Files& left, const Files& whole) {
    for (const auto& [name, bytes] : left) {
        CAPTURE(name);
        REQUIRE(whole.count(name) == 1);  // nothing partial
        if (name == "timeline.csv") {
            CHECK(whole.at(name).starts_with(bytes));
            CHECK((bytes.empty() || bytes.ends_with('\n')));
        } else if (repeats(name)) {
            CHECK(bytes == whole.at(name));
        }
    }
}

}  // namespace

TEST_CASE("a disk that fills up during a run ends it with exit code 5, and the last checkpoint resumes") {
    const Folder folder;
    std::ofstream(folder.path / "quick.toml") << kQuick;
    REQUIRE(run_program(folder.path, "run quick.toml -o whole --quiet").exit_code == 0);
    // The film makes the last checkpoint the largest file of all, so that it alone does not fit. The shell
    // counts blocks of 512 bytes. By default SIGXFSZ kills a program that exceeds this limit.
    const std::string blocks =
        std::to_string((fs::file_size(folder.path / "whole/checkpoint.vdb") - 1) / 512);
    for (const std::string trap : {"trap '' XFSZ; ", ""}) {
        const Outcome full =
            run_command(folder.path, trap + "ulimit -f " + blocks +
                                         "; '" SIDEWALL_PROGRAM "' run quick.toml -o out --quiet 2>&1");
        INFO(full.output);
        CHECK(full.exit_code == 5);
        CHECK(full.output.find("out/checkpoint.vdb: cannot write: File too large; check space") !=
              std::string::npos);
        CHECK(full.output.find("go on with: sidewall run quick.toml -o out --resume") != std::string::npos);
        const Outcome resumed = run_program(folder.path, "run quick.toml -o out --quiet --resume");
        INFO(resumed.output);
        CHECK(resumed.exit_code == 0);
        check_holds(files_in(folder.path / "out"), files_in(folder.path / "whole"));
        fs::remove_all(folder.path / "out");
    }
}

TEST_CASE("a write refused at any operation of a run ends it with exit code 5, files whole and resumable",
          "[slow]") {
    const Folder folder;
    std::ofstream(folder.path / "quick.toml") << kQuick;
    // The run saves at its start and at its end.
    const std::string run = "run quick.toml --set output.every=1 --threads 1 --quiet -o ";
    REQUIRE(run_program(folder.path, run + "whole").exit_code == 0);
    const Files whole = files_in(folder.path / "whole");
    const fs::path out = folder.path / "out";
    int operation = 0, resumes = 0;
    for (bool done = false; !done;) {
        ++operation;
        REQUIRE(operation < 500);
        fs::remove_all(out);
        const Outcome outcome = run_with_fault(folder.path, "full " + std::to_string(operation), run + "out");
        CAPTURE(operation, outcome.output);
        done = outcome.exit_code == 0;
        if (done) continue;
        CHECK(outcome.exit_code == 5);
        CHECK(outcome.output.starts_with("sidewall: out/"));
        CHECK(outcome.output.find(": cannot write: No space left on device; check space") !=
              std::string::npos);
        const Files left = files_in(out);
        check_whole(left, whole);
        if (left.count("checkpoint.vdb") == 0 || operation % 3 != 0) continue;
        ++resumes;
        const Outcome resumed = run_program(folder.path, run + "out --resume");
        INFO(resumed.output);
        CHECK(resumed.exit_code == 0);
        check_holds(files_in(out), whole);
    }
    CHECK(operation > 80);
    CHECK(resumes > 10);
}

namespace {

double cpu_seconds_of_children() {
    rusage usage{};
    REQUIRE(getrusage(RUSAGE_CHILDREN, &usage) == 0);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

TEST_CASE("a damaged checkpoint is refused by name within a second and 200 MB", "[foreign]") {
    const Folder folder;
    std::ofstream(folder.path / "quick.toml") << kQuick;
    REQUIRE(run_program(folder.path, "run quick.toml -o out --quiet").exit_code == 0);
    const fs::path path = folder.path / "out/checkpoint.vdb";
    const std::string whole = read_bytes(path);
    fs::remove(folder.path / "out/summary.json");  // else the run has ended
    std::vector<std::string> damaged;
    for (std::size_t k = 0; k < 10; ++k) damaged.push_back(whole.substr(0, k * whole.size() / 10));
    std::mt19937 random(3);
    for (int k = 0; k < 18; ++k) {
        std::string& bytes = damaged.emplace_back(whole);
        for (int flips = 0; flips < (k < 9 ? 1 : 8); ++flips) {
            const std::size_t place = random() % (k % 2 == 0 ? 4000 : bytes.size());
            bytes[place] = static_cast<char>(bytes[place] ^ 1 << random() % 8);
        }
    }
    for (std::size_t k = 0; k < damaged.size(); ++k) {
        CAPTURE(k);
        std::ofstream(path, std::ios::binary) << damaged[k];
        const double before = cpu_seconds_of_children();
        const Outcome outcome = run_program(folder.path, "run quick.toml -o out --quiet --resume", 60);
        const double seconds = cpu_seconds_of_children() - before;
        INFO(outcome.output);
        CHECK(outcome.exit_code == 3);
        if (kFullSpeed) CHECK(seconds < 1.0);
        CHECK(outcome.output.starts_with("sidewall: out/checkpoint.vdb: not a usable checkpoint: it is "));
        CHECK(std::all_of(outcome.output.begin(), outcome.output.end(),
                          [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }));
    }
    rusage usage{};  // usage of the largest child process so far
    REQUIRE(getrusage(RUSAGE_CHILDREN, &usage) == 0);
    if (kFullSpeed) CHECK(usage.ru_maxrss < 200'000);  // kB
}

TEST_CASE("what standard output or a device refuses is exit code 5, with a message") {
    const Folder folder;
    std::ofstream(folder.path / "quick.toml") << kQuick;
    std::ofstream(folder.path / "mesh.ply")
        << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
           "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
           "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    fs::create_symlink("/dev/full", folder.path / "full.csv");
    fs::create_symlink("/dev/full", folder.path / "full.vtp");
    fs::create_symlink("/dev/full", folder.path / "full.png");
    for (const std::string arguments :
         {"flux mesh.ply --rays 1000 --json - >/dev/full", "flux mesh.ply --rays 1000 --json /dev/full",
          "flux mesh.ply --rays 1000 -o full.csv", "flux mesh.ply --rays 1000 -o full.vtp",
          "simplify mesh.ply -o out.ply --method none --json - >/dev/full", "simplify mesh.ply -o full.vtp",
          "inspect mesh.ply --json - >/dev/full", "inspect mesh.ply >/dev/full",
          "check quick.toml >/dev/full", "models >/dev/full", "render mesh.ply --size 64x64 -o full.png"}) {
        const Outcome outcome =
            run_command(folder.path, "{ '" SIDEWALL_PROGRAM "' " + arguments + "; } 2>&1 </dev/null");
        CAPTURE(arguments, outcome.output);
        CHECK(outcome.exit_code == 5);
        CHECK(outcome.output.find("cannot write") != std::string::npos);
        CHECK(outcome.output.find("check space") != std::string::npos);
        if (arguments.ends_with(" >/dev/full"))
            CHECK(outcome.output.find("sidewall: standard output: ") != std::string::npos);
    }
    CHECK(fs::is_character_file("/dev/full"));

    // With closed streams no file of the run takes their descriptors.
    CHECK(run_command(folder.path, "'" SIDEWALL_PROGRAM "' check quick.toml 2>&1 >&-").exit_code == 5);
    REQUIRE(run_program(folder.path, "run quick.toml -o open --quiet").exit_code == 0);
    CHECK(
        run_command(folder.path, "'" SIDEWALL_PROGRAM "' run quick.toml -o closed >&- 2>&- <&-").exit_code ==
        5);
    check_holds(files_in(folder.path / "closed"), files_in(folder.path / "open"));
    CHECK(run_command(folder.path, "'" SIDEWALL_PROGRAM "' run quick.toml -o quiet --quiet >&- 2>&-")
              .exit_code == 0);
}
