#include "app/sweep/run_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <memory>
#include <optional>
#include <thread>

#include "app/common/files.hpp"
#include "app/common/free_memory.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/processes.hpp"
#include "app/common/text.hpp"
#include "app/process/estimate/memory.hpp"
#include "app/process/record/manifest.hpp"
#include "app/process/state.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/results/result.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr double kProgram = 1e8;  // bytes of a process before it has a wafer
constexpr int kCannotWrite = 5, kInterrupted = 130, kSignalled = 128;
constexpr auto kPause = std::chrono::milliseconds(10), kSharedPause = std::chrono::milliseconds(50);

// Refuses a folder that holds a run of another recipe.
void require_own(const fs::path& path, const std::string& recipe) {
    if (surface::read_whole_file(path) != recipe)
        throw RecipeError("{}: is not this run's recipe: choose another folder with -o", path.string());
}

// Reads the summary that a run leaves if it ends well; false without one.
bool read_end(RunSet& set, std::size_t number) {
    const fs::path folder = folder_of(set, number);
    if (!is_there(folder / "summary.json")) return false;
    SetRun& run = set.runs[number - 1];
    require_own(folder / "recipe.toml", run.recipe);
    run.summary = read_whole_summary(folder);
    run.status = "ok";
    return run.ended = true;
}

// The last message of a failed run, without the program's name.
std::string reason(const ProcessEnd& end) {
    if (end.exit_code == kSignalled + SIGKILL)
        return "killed from outside, as the system does when memory runs out";
    if (end.exit_code >= kSignalled) return fmt::format("ended by signal {}", end.exit_code - kSignalled);
    std::string last;
    for (const std::string& line : split(end.messages, '\n'))
        if (!line.empty()) last = line;
    constexpr std::string_view kName = "sidewall: ";
    if (last.starts_with(kName)) last.erase(0, kName.size());
    last.erase(std::min(last.find("; then go on with: "), last.size()));  // the set resumes it instead
    return last.empty() ? fmt::format("exit code {}", end.exit_code) : last;
}

std::size_t count_ended(const RunSet& set) {
    return static_cast<std::size_t>(
        std::count_if(set.runs.begin(), set.runs.end(), [](const SetRun& run) { return run.ended; }));
}

// Where ranks share the runs of a folder: the lock of a run's rank, and the file that says why a run failed.
constexpr const char* kClaim = ".sidewall.claim";
constexpr const char* kFailed = "failed.txt";

std::unique_ptr<FolderLock> claim_run(const fs::path& folder) {
    try {
        return std::make_unique<FolderLock>(folder, kClaim);
    } catch (const HeldElsewhere&) {
        return nullptr;
    }
}

// Reads how a run has ended, which another rank may have made; false if it has not.
bool read_any_end(RunSet& set, std::size_t number) {
    if (read_end(set, number)) return true;
    const fs::path failed = folder_of(set, number) / kFailed;
    if (!is_there(failed)) return false;
    SetRun& run = set.runs[number - 1];
    run.status = surface::read_whole_file(failed);
    return run.ended = true;
}

struct Running {
    std::size_t number;
    std::unique_ptr<ChildProcess> process;
    std::unique_ptr<FolderLock> claim;
};

// Makes runs in child processes, several at a time, until all have ended.
class Pool {
  public:
    Pool(RunSet& set, const std::vector<std::size_t>& numbers, ProgressBar& progress,
         const std::function<void(std::size_t number)>& ended)
        : set_(set), progress_(progress), ended_(ended), waiting_(numbers.begin(), numbers.end()) {
        const auto threads = static_cast<std::size_t>(thread_count());
        const std::size_t share =
            shared_ ? (numbers.size() + ranks().count - 1) / ranks().count : numbers.size();
        jobs_ = std::max<std::size_t>(1, std::min(set.jobs > 0 ? set.jobs : threads, share));
        threads_ = std::max<std::size_t>(1, threads / jobs_);
        free_ = free_memory().bytes / ranks().on_this_machine;
    }

    void make_all() {
        while (!waiting_.empty() || !running_.empty()) {
            if (interrupted()) stop();
            while (running_.size() < jobs_ && start_one()) {
            }
            collect();
            std::this_thread::sleep_for(shared_ ? kSharedPause : kPause);
        }
    }

  private:
    // Starts the first waiting run that can start, or takes its result; those that others write come later.
    bool start_one() {
        for (auto next = waiting_.begin(); next != waiting_.end(); ++next) {
            const std::size_t number = *next;
            const SetRun& run = set_.runs[number - 1];
            if (shared_ && read_any_end(set_, number)) {
                waiting_.erase(next);
                end_one(number);
                return true;
            }
            if (!running_.empty() && memory_ + run.memory > free_) return false;
            std::unique_ptr<FolderLock> claimed = shared_ ? claim_run(folder_of(set_, number)) : nullptr;
            if (shared_ && !claimed) continue;
            if (const auto who = lock_holder(folder_of(set_, number))) {
                tell_once(fmt::format("run {:04}: {} is writing there: waiting for it", number, *who));
                continue;
            }
            waiting_.erase(next);
            if (read_end(set_, number) || (shared_ && read_any_end(set_, number))) {
                end_one(number);
                return true;
            }
            write_run_recipe(set_, number);
            std::vector<std::string> arguments = run_arguments(set_, number);
            arguments.insert(arguments.end(), {"--quiet", "--threads", std::to_string(threads_)});
            running_.push_back({number, std::make_unique<ChildProcess>(arguments), std::move(claimed)});
            memory_ += run.memory;
            return true;
        }
        return false;
    }

    void collect() {
        for (std::size_t i = 0; i < running_.size();) {
            const std::optional<ProcessEnd> end = running_[i].process->end();
            if (!end) {
                ++i;
                continue;
            }
            const std::size_t number = running_[i].number;
            SetRun& run = set_.runs[number - 1];
            const std::unique_ptr<FolderLock> claimed = std::move(running_[i].claim);
            running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
            memory_ -= run.memory;
            if (end->exit_code == kInterrupted) stop();
            if (end->exit_code == kCannotWrite && set_.needs_all) {
                stop_all();
                const std::string& again = set_.resume_command;  // a helping rank has none
                throw IoError("run {:04}: {}{}{}", number, reason(*end),
                              again.empty() ? "" : "; then go on with: ", again);
            }
            if (end->exit_code != 0 || !read_end(set_, number)) {
                run.status = reason(*end);
                run.ended = true;
                if (shared_) write_file(folder_of(set_, number) / kFailed, run.status);
                progress_.line(fmt::format("run {:04} failed: {}", number, run.status));
            }
            end_one(number);
        }
    }

    void end_one(std::size_t number) {
        ended_(number);
        progress_.update(static_cast<double>(count_ended(set_)), fmt::format("{} running", running_.size()));
    }

    void tell_once(const std::string& text) {
        if (std::find(told_.begin(), told_.end(), text) != told_.end()) return;
        told_.push_back(text);
        progress_.line(text);
    }

    void stop_all() {
        for (const Running& run : running_) run.process->stop(SIGTERM);
        while (!running_.empty()) {
            std::erase_if(running_, [](Running& run) { return run.process->end().has_value(); });
            std::this_thread::sleep_for(kPause);
        }
    }

    [[noreturn]] void stop() {
        stop_all();
        throw Interrupted("stopped with {} runs made; go on with: {}", count_ended(set_),
                          set_.resume_command);
    }

    RunSet& set_;
    ProgressBar& progress_;
    const std::function<void(std::size_t number)>& ended_;
    std::deque<std::size_t> waiting_;
    std::vector<Running> running_;
    std::vector<std::string> told_;
    std::size_t jobs_ = 1, threads_ = 1;
    const bool shared_ = ranks().count > 1;
    double free_ = 0.0, memory_ = 0.0;  // bytes: free at the start, and needed by the running ones
};

std::string differing(const Json& now, const Json& there) {
    std::string names;
    for (const auto& [name, value] : now.items())
        if (name != "digest" && there.value(name, Json()) != value)
            names += (names.empty() ? "" : ", ") + name;
    return names.empty() ? "the recipe" : names;
}

}  // namespace

std::size_t add_run(RunSet& set, const Recipe& recipe) {
    const std::string text = effective_recipe(recipe);
    const auto [place, is_new] = set.numbers.try_emplace(text, set.runs.size() + 1);
    if (is_new)
        set.runs.push_back(
            {.recipe = text, .memory = kProgram + estimated_memory(recipe, domain_of(recipe))});
    return place->second;
}

void adopt_runs(RunSet& set) {
    for (std::size_t number = set.runs.size() + 1; is_there(folder_of(set, number) / "recipe.toml");
         ++number) {
        const std::string file = (folder_of(set, number) / "recipe.toml").string();
        const std::string text = surface::read_whole_file(file);
        const Recipe recipe = parse_recipe(text, file);
        set.numbers.try_emplace(text, number);
        set.runs.push_back(
            {.recipe = text, .memory = kProgram + estimated_memory(recipe, domain_of(recipe))});
    }
}

fs::path folder_of(const RunSet& set, std::size_t number) {
    return set.folder / "runs" / fmt::format("{:04}", number);
}

std::vector<std::string> run_arguments(const RunSet& set, std::size_t number) {
    const fs::path folder = folder_of(set, number);
    std::string path = folder.string();
    if (path.starts_with('-')) path.insert(0, "./");  // lest it is read as an option
    std::vector<std::string> arguments{"run", path + "/recipe.toml", "-o", path};
    if (is_there(folder / kManifest)) arguments.push_back("--resume");
    return arguments;
}

void write_run_recipe(const RunSet& set, std::size_t number) {
    const fs::path path = folder_of(set, number) / "recipe.toml";
    const std::string& text = set.runs[number - 1].recipe;
    if (is_there(path)) return require_own(path, text);
    remove_partial_files(path.parent_path(), {"recipe.toml"});
    write_file(path, text);
}

void make_runs(RunSet& set, const std::vector<std::size_t>& numbers, ProgressBar& progress,
               const std::function<void(std::size_t number)>& ended) {
    std::vector<std::size_t> left;
    for (const std::size_t number : std::set<std::size_t>(numbers.begin(), numbers.end()))
        if (!set.runs[number - 1].ended && !read_end(set, number)) left.push_back(number);
    refuse_link(set.folder / "runs");
    for (const std::size_t number : left) {
        refuse_link(folder_of(set, number));
        std::error_code failure;
        fs::remove(folder_of(set, number) / kFailed, failure);  // the run is tried again
        if (ranks().count > 1) write_run_recipe(set, number);   // for all ranks to see
    }
    ended(0);
    if (!left.empty()) Pool(set, left, progress, ended).make_all();
}

void help_with_runs(const fs::path& folder, std::size_t jobs) {
    constexpr int kPatience = 1200;  // pauses, a minute in all
    const auto began = fs::file_time_type::clock::now() - std::chrono::seconds(5);
    const auto is_new = [&](const char* file) {
        std::error_code failure;
        const auto time = fs::last_write_time(folder / file, failure);
        return !failure && time > began;
    };
    for (int pauses = 0; !lock_holder(folder); ++pauses) {
        // Where there was little to do, the first rank may have ended already and left a new plan.
        if (interrupted() || pauses == kPatience || is_new("sweep.json") || is_new("fit.json")) return;
        std::this_thread::sleep_for(kSharedPause);
    }
    RunSet set{.folder = folder, .jobs = jobs, .needs_all = is_there(folder / "fit.json")};
    ProgressBar silent("", 1.0, "", false);
    while (lock_holder(folder) && !interrupted()) {
        const std::size_t known = set.runs.size();
        adopt_runs(set);
        std::vector<std::size_t> fresh;
        for (std::size_t number = known + 1; number <= set.runs.size(); ++number)
            if (!read_any_end(set, number)) fresh.push_back(number);
        if (!fresh.empty()) Pool(set, fresh, silent, [](std::size_t) {}).make_all();
        std::this_thread::sleep_for(kSharedPause);
    }
}

std::size_t read_ended(RunSet& set) {
    std::size_t count = 0;
    for (std::size_t number = 1; number <= set.runs.size(); ++number) count += read_end(set, number) ? 1 : 0;
    return count;
}

Json files_of_plan(const std::set<std::string>& paths) {
    Json files = Json::object();
    for (const InputFile& file : input_files(paths)) files[file.path] = file.digest;
    return files;
}

void open_batch_folder(const fs::path& folder, const std::string& file, const std::string& what,
                       const Json& plan, bool resume) {
    std::error_code failure;
    remove_partial_files(folder, {file, fs::path(file).replace_extension("csv").string()});
    if (!fs::exists(folder / file, failure)) {
        for (const char* other : {"sweep.json", "fit.json", "runs", "manifest.txt", "compare.json"})
            if (fs::exists(folder / other, failure))
                throw RecipeError("{}: holds other results ({}): choose another folder with -o",
                                  folder.string(), other);
        return;
    }
    const Json there = read_json(folder / file, "choose another folder with -o");
    if (!there.is_object() || there.value("digest", Json()) != plan["digest"])
        throw RecipeError("{}: holds another {}, which differs in {}: choose another folder with -o",
                          folder.string(), what, there.is_object() ? differing(plan, there) : file);
    if (!resume)
        throw RecipeError("{}: holds this {} already: go on with --resume, or choose another folder with -o",
                          folder.string(), what);
}

}  // namespace sidewall::app
