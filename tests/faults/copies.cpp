// SIDEWALL_FAULT="each DEPTH": forks a copy of the program for every chain of the DEPTH innermost callers,
// from main on, of a call on a file. The program runs in work/ beside expected/, the files of an undisturbed
// run. Copies run in copy/; report.txt counts how they ended. A wrong end is listed in wrong.txt; its folder
// is kept as copy-N/, with callers.txt.
#include "tests/faults/copies.hpp"

#include <execinfo.h>
#include <fcntl.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <unordered_set>

namespace sidewall::faults {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepest = 64;
constexpr unsigned kSeconds = 60;  // seconds in which a copy must have ended

struct Survey {
    int depth = 16;
    pid_t process = 0;
    fs::path root;  // the folder that holds work and expected
    std::unordered_set<std::size_t> seen;
    std::map<std::string, int> ends;  // number of copies by how they ended
    int copies = 0, wrong = 0;
};

Survey* survey = nullptr;
bool busy = false;  // the survey's own calls do not fail

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

// In a copy: reopens the files open in work as the same files of the copy's folder.
void move_into(const fs::path& folder) {
    const std::string work = (survey->root / "work").string() + "/";
    for (int file = 3; file < 256; ++file) {
        const int flags = ::fcntl(file, F_GETFL);
        std::array<char, 4096> name{};
        if (flags < 0 || ::readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), name.data(), 4095) < 0)
            continue;
        if (!std::string(name.data()).starts_with(work)) continue;
        if (fs::is_directory(name.data()) && (flags & O_PATH) == 0) continue;
        const fs::path own = folder / (name.data() + work.size());
        const off_t place = ::lseek(file, 0, SEEK_CUR);
        const int opened = ::open(own.c_str(), flags & (O_ACCMODE | O_APPEND | O_PATH));
        if (opened < 0) ::_exit(99);
        ::lseek(opened, place, SEEK_SET);
        ::dup3(opened, file, O_CLOEXEC);
        ::close(opened);
    }
    fs::current_path(folder);
    const int said = ::open("said.txt", O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ::dup2(said, 1);
    ::dup2(said, 2);
    ::close(said);
}

// Files with the same bytes whenever and wherever they are written: surfaces, interfaces, recipes and notes.
bool repeats(const fs::path& path) {
    return path.extension() == ".vtp" || path.extension() == ".toml" || path.filename() == "notes.txt";
}

// What is wrong with the files of a copy that has ended; empty if nothing is.
std::string judge_files(const fs::path& folder, bool ended_well) {
    const fs::path expected = survey->root / "expected";
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const fs::path name = fs::relative(entry.path(), folder);
        if (entry.is_directory() || name == "said.txt" || name.filename() == ".sidewall.lock") continue;
        if (!fs::exists(expected / name)) return "has left " + name.string();
        if (name.filename() == "timeline.csv" ? !read(expected / name).starts_with(read(entry.path()))
                                              : repeats(name) && read(entry.path()) != read(expected / name))
            return "has damaged " + name.string();
    }
    for (const auto& entry : fs::recursive_directory_iterator(expected)) {
        const fs::path name = fs::relative(entry.path(), expected);
        // Files that the run does not write (outside out/) must survive whatever happens.
        if ((ended_well || !name.string().starts_with("out/")) && !fs::exists(folder / name))
            return "has lost " + name.string();
    }
    return "";
}

// How a copy ended, as a heading of the report; "WRONG: ..." if it should not have ended like that.
std::string judge(int status, const fs::path& folder) {
    const std::string said = read(folder / "said.txt");
    if (WIFSIGNALED(status))
        return "WRONG: " + std::string(WTERMSIG(status) == SIGALRM ? "hangs" : strsignal(WTERMSIG(status)));
    const int code = WEXITSTATUS(status);
    if (const std::string wrong = judge_files(folder, code == 0); !wrong.empty()) return "WRONG: " + wrong;
    if (code == 0) return "does without";
    const bool message = said.starts_with("sidewall: ") && std::count(said.begin(), said.end(), '\n') <= 2;
    const bool coded = code == 5 || code == 3;
    if (!message) return "WRONG: exit code " + std::to_string(code) + ", says " + said;
    return (coded ? "" : "WRONG: ") + ("exit code " + std::to_string(code));
}

void write_report() {
    std::ofstream report(survey->root / "report.txt");
    report << survey->copies << " copies of " << survey->seen.size() << " chains of callers\n";
    for (const auto& [end, count] : survey->ends) report << count << " " << end << "\n";
}

void tell(const std::string& end, const char* what, void* const* callers, int depth) {
    ++survey->wrong;
    std::ofstream(survey->root / "wrong.txt", std::ios::app)
        << "copy " << survey->copies << ": " << what << ": " << end << "\n";
    if (survey->wrong > 200) return;
    const fs::path kept = survey->root / ("copy-" + std::to_string(survey->copies));
    fs::rename(survey->root / "copy", kept);
    const int file = ::open((kept / "callers.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ::backtrace_symbols_fd(callers, depth, file);
    ::close(file);
}

// Forks. Returns true in the copy; in the original, after the copy has ended and been judged, false.
bool copied(const char* what, void* const* callers, int depth) {
    const fs::path folder = survey->root / "copy";
    fs::remove_all(folder);
    fs::copy(survey->root / "work", folder, fs::copy_options::recursive);
    ++survey->copies;
    const pid_t copy = ::fork();
    if (copy == 0) {
        ::alarm(kSeconds);
        move_into(folder);
        return true;
    }
    int status = 0;
    if (copy < 0 || ::waitpid(copy, &status, 0) != copy) ::_exit(98);
    const std::string end = judge(status, folder);
    ++survey->ends[end];
    if (end.starts_with("WRONG")) tell(end, what, callers, depth);
    return false;
}

// Exit handler. Fork copies no threads of libraries, so a copy must not wait for them: it ends at once.
void end(int status, void*) {
    busy = true;
    if (survey != nullptr) return write_report();
    std::fflush(nullptr);
    ::_exit(status);
}

}  // namespace

bool fails_here(const char* what) {
    if (survey == nullptr || busy || ::gettid() != survey->process) return false;
    const int before = errno;
    busy = true;
    std::array<void*, kDeepest> callers{};
    const int depth = ::backtrace(callers.data(), std::min(survey->depth + 2, kDeepest));
    std::size_t key = 14695981039346656037u;
    for (int k = 2; k < depth; ++k)
        key = (key ^ reinterpret_cast<std::size_t>(callers[static_cast<std::size_t>(k)])) * 1099511628211u;
    const bool fails = survey->seen.insert(key).second && copied(what, callers.data(), depth);
    if (fails) survey = nullptr;
    busy = false;
    errno = before;
    return fails;
}

void begin_survey() {
    const char* text = std::getenv("SIDEWALL_FAULT");
    std::string each;
    auto asked = std::make_unique<Survey>();
    std::istringstream(text == nullptr ? "" : text) >> each >> asked->depth;
    if (each != "each") return;
    asked->process = ::getpid();
    asked->root = fs::current_path().parent_path();
    std::array<void*, kDeepest> first{};
    ::backtrace(first.data(), kDeepest);  // loads the library that backtrace needs
    ::on_exit(end, nullptr);
    survey = asked.release();  // lives until the process ends
}

}  // namespace sidewall::faults
