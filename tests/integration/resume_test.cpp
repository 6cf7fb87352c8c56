#include <fcntl.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "app/common/files.hpp"
#include "tests/integration/run_program.hpp"

using namespace sidewall::test;
namespace fs = std::filesystem;

namespace {

// Two steps that trace and one that does not; saves surfaces, interfaces, traced meshes and profiles.
const std::string kResumed = R"(
[domain]
extent = [2.0, 1.0]
grid_spacing = 0.25
[[layer]]
material = "Si"
shape = "trench"
width = 1.0
depth = 0.5
[flux]
rays = 500
[output]
profiles = ["y=0"]
)";
const std::string kResumedDeposit = R"(
[[step]]
model = "single_particle"
rate = 1.0
sticking = 0.5
duration = 0.2
deposit = "SiO2"
)";
const std::string kResumedEtch = R"(
[[step]]
model = "isotropic"
rate = -1.0
duration = 0.2
)";

// A run's files without seconds, which the checkpoint holds among its grids: of this only the name.
std::map<std::string, std::string> files(const fs::path& folder) {
    std::map<std::string, std::string> bytes;
    for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        if (name == ".sidewall.lock") continue;  // left by a killed process
        bytes[name] = name == "checkpoint.vdb" ? "" : read_bytes(entry.path());
        if (name != "summary.json") continue;
        auto summary = nlohmann::json::parse(bytes[name]);
        summary.erase("timing");
        bytes[name] = summary.dump();
    }
    return bytes;
}

// Names of the files that differ.
std::string unequal(const fs::path& a, const fs::path& b) {
    const auto one = files(a), other = files(b);
    std::string names;
    for (const auto& [name, bytes] : one)
        if (!other.contains(name) || other.at(name) != bytes) names += name + " ";
    for (const auto& [name, bytes] : other)
        if (!one.contains(name)) names += name + " ";
    return names;
}

// Detects system calls that change files.
class FileOperations {
  public:
    bool is_one(const __ptrace_syscall_info& call) {
        const auto number = call.entry.nr;
        const bool writes = number == SYS_write || number == SYS_writev || number == SYS_pwrite64;
        // Of consecutive writes to one file the first two count.
        repeats_ = writes && call.entry.args[0] == file_ ? repeats_ + 1 : 0;
        file_ = writes ? call.entry.args[0] : 0;
        if (writes) return call.entry.args[0] > 2 && repeats_ < 2;
        if (number == SYS_openat) return (call.entry.args[2] & O_CREAT) != 0;
        for (const auto other : kOthers)
            if (number == static_cast<std::uint64_t>(other)) return true;
        return false;
    }

  private:
    static constexpr long kOthers[] = {
#ifdef SYS_rename
        SYS_rename,    SYS_unlink,   SYS_mkdir,    SYS_rmdir,
#endif
        SYS_renameat2, SYS_renameat, SYS_unlinkat, SYS_mkdirat, SYS_ftruncate, SYS_fsync, SYS_fdatasync};
    std::uint64_t file_ = 0, repeats_ = 0;
};

pid_t start(const fs::path& folder, const std::vector<std::string>& arguments, bool traced) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child > 0) return child;
    const int log = open((folder / "log").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    dup2(log, 1);
    dup2(log, 2);
    std::vector<char*> words{const_cast<char*>("sidewall")};
    for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
    words.push_back(nullptr);
    if (chdir(folder.c_str()) != 0 || (traced && ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0))
        _exit(126);
    execv(SIDEWALL_PROGRAM, words.data());
    _exit(127);
}

// Runs the program and kills it before its file operation number \p operation, counted from 0. False if it
// ended before.
bool killed_at(std::size_t operation, const fs::path& folder, const std::vector<std::string>& arguments) {
    const pid_t child = start(folder, arguments, true);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    if (WIFEXITED(status)) FAIL("cannot trace a program here: exit code " << WEXITSTATUS(status));
    REQUIRE(ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL) == 0);
    FileOperations operations;
    std::size_t count = 0;
    int signal = 0;
    while (ptrace(PTRACE_SYSCALL, child, nullptr, signal) == 0 && waitpid(child, &status, 0) == child) {
        if (WIFEXITED(status)) REQUIRE(WEXITSTATUS(status) == 0);
        if (!WIFSTOPPED(status)) return false;
        const bool at_call = WSTOPSIG(status) == (SIGTRAP | 0x80);
        signal = at_call ? 0 : WSTOPSIG(status);
        __ptrace_syscall_info call{};
        if (!at_call || ptrace(PTRACE_GET_SYSCALL_INFO, child, sizeof call, &call) <= 0) continue;
        if (call.op != PTRACE_SYSCALL_INFO_ENTRY || !operations.is_one(call) || count++ < operation) continue;
        kill(child, SIGKILL);
        waitpid(child, &status, 0);
        return true;
    }
    return false;
}

const std::string kRun = "run recipe --threads 1 --quiet -o ";

bool holds(const Outcome& outcome, const std::string& text) {
    return outcome.output.find(text) != std::string::npos;
}

// A run of the recipe in \p folder, killed after its first checkpoint.
void leave_unfinished(const fs::path& folder, const std::string& output) {
    for (std::size_t operation = 40; !fs::exists(folder / output / "checkpoint.vdb"); operation += 10) {
        fs::remove_all(folder / output);
        REQUIRE(killed_at(operation, folder, {"run", "recipe", "--threads", "1", "-o", output}));
    }
    REQUIRE_FALSE(fs::exists(folder / output / "summary.json"));
}

}  // namespace

TEST_CASE("a run that is killed before any file operation and resumed equals one that was not", "[slow]") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    REQUIRE(run_program(folder.path, kRun + "whole").exit_code == 0);
    const fs::path stopped = folder.path / "stopped";
    std::size_t operation = 0;
    for (; killed_at(operation, folder.path, {"run", "recipe", "-o", "stopped", "--threads", "1"});
         ++operation) {
        INFO("killed before file operation " << operation);
        auto resumed = run_program(folder.path, kRun + "stopped --resume");
        if (!fs::exists(stopped / "manifest.txt")) {  // the run had not begun
            CHECK(resumed.exit_code == 3);
            resumed = run_program(folder.path, kRun + "stopped");
        }
        INFO(resumed.output);
        CHECK(resumed.exit_code == 0);
        CHECK(unequal(stopped, folder.path / "whole") == "");
        fs::remove_all(stopped);
    }
    CHECK(operation > 60);
}

TEST_CASE("a run killed after the save at a step's start saves that surface once when it is resumed") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    REQUIRE(run_program(folder.path, kRun + "whole").exit_code == 0);
    leave_unfinished(folder.path, "stopped");
    // Partial files that a killed run was writing are removed, but nobody else's.
    for (const char* name : {"surface_0000.vtp.17.partial", "surface.pvd.17-3.partial", "mine.17.partial"})
        write_bytes(folder.path / "stopped" / name, "half");
    REQUIRE(run_program(folder.path, kRun + "stopped --resume").exit_code == 0);
    CHECK(unequal(folder.path / "stopped", folder.path / "whole") == "mine.17.partial ");
}

TEST_CASE("a second run into a folder is refused, and told which process writes there") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedEtch);
    fs::create_directory(folder.path / "out");
    {
        const sidewall::app::FolderLock lock(folder.path / "out");
        for (const char* resume : {"", " --resume", " --overwrite"}) {
            const auto second = run_program(folder.path, kRun + "out" + resume);
            CHECK(second.exit_code == 5);
            CHECK(holds(second, "process " + std::to_string(getpid()) + " on "));
        }
        CHECK_FALSE(fs::exists(folder.path / "out" / "recipe.toml"));
    }
    // The lock of a process that has ended does not count.
    write_bytes(folder.path / "out" / ".sidewall.lock", "process 1 on some host");
    CHECK(run_program(folder.path, kRun + "out").exit_code == 0);
    CHECK_FALSE(fs::exists(folder.path / "out" / ".sidewall.lock"));
}

TEST_CASE("a run removes what a run wrote, and nothing else") {
    const Folder folder;
    const fs::path out = folder.path / "out";
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    fs::create_directory(out);
    write_bytes(out / "surface_9999.vtp", "mine");
    REQUIRE(run_program(folder.path, kRun + "out").exit_code == 0);
    // A result of the same recipe is replaced without asking.
    write_bytes(out / "traced_0077.vtp", "mine");
    REQUIRE(run_program(folder.path, kRun + "out").exit_code == 0);
    CHECK(read_bytes(out / "surface_9999.vtp") == "mine");
    CHECK(read_bytes(out / "traced_0077.vtp") == "mine");
    // A file in the way that no manifest lists is not replaced.
    for (const char* name : {"surface_0001.vtp", "summary.json", "manifest.txt"}) {
        fs::remove_all(out);
        fs::create_directory(out);
        write_bytes(out / name, "mine");
        const auto refused = run_program(folder.path, kRun + "out");
        CHECK(refused.exit_code == 2);
        CHECK(holds(refused, std::string(name) + ": "));
        CHECK(holds(refused, "--overwrite"));
        CHECK(std::distance(fs::directory_iterator(out), {}) == 1);
        CHECK(read_bytes(out / name) == "mine");
        CHECK(run_program(folder.path, kRun + "out --overwrite").exit_code == 0);
        CHECK(read_bytes(out / name) != "mine");
    }
    // A result without a manifest lists its files in surface.pvd alone; these are removed, too.
    fs::remove(out / "manifest.txt");
    write_bytes(out / "surface.pvd", "<DataSet timestep=\"9\" part=\"0\" file=\"surface_0040.vtp\"/>");
    for (const char* name :
         {"surface_0040.vtp", "interface_0040_0.vtp", "profile_0040.csv", "surface_0041.vtp"})
        write_bytes(out / name, "old");
    REQUIRE(run_program(folder.path, kRun + "out --overwrite").exit_code == 0);
    for (const char* name : {"surface_0040.vtp", "interface_0040_0.vtp", "profile_0040.csv"})
        CHECK_FALSE(fs::exists(out / name));
    CHECK(read_bytes(out / "surface_0041.vtp") == "old");
    // Names in a manifest that lead out of the folder are ignored.
    write_bytes(folder.path / "precious", "mine");
    std::ofstream(out / "manifest.txt", std::ios::app) << "../precious\n..\n.\n\nsurface_9";
    write_bytes(out / "surface_9", "mine");
    CHECK(run_program(folder.path, kRun + "out").exit_code == 0);
    CHECK(read_bytes(folder.path / "precious") == "mine");
    CHECK(read_bytes(out / "surface_9") == "mine");
}

TEST_CASE("an unfinished run and another recipe's result are replaced only when asked for") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    leave_unfinished(folder.path, "out");
    const auto before = files(folder.path / "out");
    const auto unfinished = run_program(folder.path, kRun + "out");
    CHECK(unfinished.exit_code == 2);
    CHECK(holds(unfinished, "an unfinished run of this recipe: go on with --resume"));
    CHECK(holds(unfinished, "--overwrite"));
    const auto other = run_program(folder.path, kRun + "out --set flux.seed=2");
    CHECK(other.exit_code == 2);
    CHECK(holds(other, "an unfinished run of another recipe"));
    CHECK(files(folder.path / "out") == before);
    REQUIRE(run_program(folder.path, kRun + "out --overwrite").exit_code == 0);

    const auto result = run_program(folder.path, kRun + "out --set flux.seed=2");
    CHECK(result.exit_code == 2);
    CHECK(holds(result, "the result of another recipe"));
    CHECK(run_program(folder.path, kRun + "out --set flux.seed=2 --overwrite").exit_code == 0);
    CHECK(run_program(folder.path, kRun + "out --set flux.seed=2 --overwrite --resume").exit_code == 2);
}

TEST_CASE("a finished run goes on with further steps and more repeats as if they had been there") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit);
    REQUIRE(run_program(folder.path, kRun + "extended").exit_code == 0);
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    REQUIRE(run_program(folder.path, kRun + "whole").exit_code == 0);
    REQUIRE(run_program(folder.path, kRun + "extended --resume").exit_code == 0);
    CHECK(unequal(folder.path / "extended", folder.path / "whole") == "");

    // Reports call the step "cycle 2 of 2" instead.
    const auto again = run_program(folder.path, kRun + "extended --set step[1].repeat=2 --resume");
    INFO(again.output);
    CHECK(again.exit_code == 0);
    REQUIRE(run_program(folder.path, kRun + "whole --set step[1].repeat=2 --overwrite").exit_code == 0);
    CHECK(unequal(folder.path / "extended", folder.path / "whole") == "timeline.csv ");
}

TEST_CASE("a finished run goes on with a longer last step, and not with a shorter one") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    const std::string every = " --set output.every=0.1", longer = every + " --set step[1].duration=0.4";
    REQUIRE(run_program(folder.path, kRun + "extended" + every).exit_code == 0);
    REQUIRE(run_program(folder.path, kRun + "whole" + longer).exit_code == 0);
    REQUIRE(run_program(folder.path, kRun + "extended --resume" + longer).exit_code == 0);
    CHECK(unequal(folder.path / "extended", folder.path / "whole") == "");

    const auto before = files(folder.path / "extended");
    const auto refuses = [&](const std::string& setting, const std::string& told) {
        const auto outcome =
            run_program(folder.path, kRun + "extended --resume" + longer + " --set " + setting);
        INFO(outcome.output);
        CHECK(outcome.exit_code == 3);
        CHECK(holds(outcome, told));
    };
    refuses("step[1].duration=0.3", "step 2 (2 isotropic): duration = 0.3 (there 0.4 are done)");
    refuses("step[0].sticking=0.4", "step 1 (1 single_particle): sticking = 0.4 (there 0.5)");
    refuses("step[0].duration=0.3", "step 1 (1 single_particle): duration = 0.3 (there 0.2)");
    refuses("layer[0].depth=0.6", "layer[0].depth = 0.6 (there 0.5)");
    refuses("step[1].stop_depth=0.1", "step 2 (2 isotropic): an earlier stop_depth");
    CHECK(files(folder.path / "extended") == before);
}

TEST_CASE("a moved project goes on: files that the recipe names are known by what is in them") {
    const Folder folder;
    const fs::path home = folder.path / "home";
    fs::create_directory(home);
    write_bytes(home / "ridge.csv", "x,z\n-1,0\n-0.5,0\n-0.5,0.5\n0.5,0.5\n0.5,0\n1,0\n");
    write_bytes(home / "recipe",
                kResumed + "[[layer]]\nmaterial = \"SiO2\"\nshape = \"profile\"\nfile = \"ridge.csv\"\n" +
                    kResumedDeposit + kResumedEtch);
    REQUIRE(run_program(home, kRun + "whole").exit_code == 0);
    leave_unfinished(home, "stopped");
    const fs::path there = folder.path / "there";
    fs::rename(home, there);
    write_bytes(there / "ridge.csv", read_bytes(there / "ridge.csv") + "# another\n");
    const auto changed = run_program(there, kRun + "stopped --resume");
    INFO(changed.output);
    CHECK(changed.exit_code == 3);
    CHECK(holds(changed, "ridge.csv is not what it was"));
    std::string profile = read_bytes(there / "ridge.csv");
    write_bytes(there / "ridge.csv", profile.substr(0, profile.find('#')));
    const auto resumed = run_program(there, kRun + "stopped --resume");
    INFO(resumed.output);
    REQUIRE(resumed.exit_code == 0);
    CHECK(unequal(there / "stopped", there / "whole") == "recipe.toml ");  // it names the file
}

TEST_CASE("an extension of a finished run that fails says how to get back") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit + kResumedEtch);
    REQUIRE(run_program(folder.path, kRun + "whole").exit_code == 0);
    fs::copy(folder.path / "whole", folder.path / "out");
    const std::string longer = kRun + "out --resume --set step[1].duration=0.4";
    const auto failed = run_with_fault(folder.path, "full 12", longer);
    INFO(failed.output);
    CHECK(failed.exit_code == 5);
    CHECK(holds(failed, "its checkpoint is as it was: --resume with the recipe as it was"));
    REQUIRE_FALSE(fs::exists(folder.path / "out" / "summary.json"));
    REQUIRE(run_program(folder.path, kRun + "out --resume").exit_code == 0);
    CHECK(unequal(folder.path / "out", folder.path / "whole") == "");
}

TEST_CASE("a closed terminal ends a run like Ctrl-C: it can be resumed") {
    const Folder folder;
    write_bytes(folder.path / "recipe", kResumed + kResumedDeposit);
    // So many traced cycles, which move nothing, that the run would take minutes to end by itself.
    const std::vector<std::string> settings{"step[0].repeat=100000", "step[0].duration=1e-6"};
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    REQUIRE(terminal >= 0);
    REQUIRE(grantpt(terminal) == 0);
    REQUIRE(unlockpt(terminal) == 0);
    const std::string name = ptsname(terminal);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        setsid();
        signal(SIGHUP, SIG_DFL);                     // ignored where nohup started the tests
        const int end = open(name.c_str(), O_RDWR);  // becomes the controlling terminal
        for (int stream = 0; stream < 3; ++stream) dup2(end, stream);
        if (chdir(folder.path.c_str()) != 0) _exit(126);
        execl(SIDEWALL_PROGRAM, "sidewall", "run", "recipe", "-o", "out", "--set", settings[0].c_str(),
              "--set", settings[1].c_str(), nullptr);
        _exit(127);
    }
    const fs::path timeline = folder.path / "out" / "timeline.csv";
    for (int tick = 0; tick < 3000 && !fs::exists(timeline); ++tick)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    REQUIRE(fs::exists(timeline));
    close(terminal);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    REQUIRE(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 130);
    CHECK(fs::exists(folder.path / "out" / "checkpoint.vdb"));
    CHECK_FALSE(fs::exists(folder.path / "out" / "summary.json"));
}
