#include "app/workbench/runs.hpp"

#include <fmt/format.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <array>
#include <csignal>
#include <cstring>
#include <limits>
#include <mutex>
#include <regex>
#include <semaphore>
#include <thread>

#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/report/parts.hpp"
#include "app/report/recipe_page.hpp"

namespace sidewall::app {
namespace {

struct {
    std::mutex lock;
    std::vector<pid_t> processes;
} started;

// A file of results as JSON; null if it is missing or not an object.
Json json_in(const Descriptor& run, const std::string& name) {
    constexpr std::size_t kMostValues = 50'000;
    Json json = parse_json(text_of(open_file(run, name.c_str())), kMostValues);
    return json.is_object() ? json : Json();
}

std::string kind_of(const Descriptor& run) {
    for (std::string kind : {"sweep", "fit", "compare", "study", "validation"})
        if (open_file(run, (kind + ".json").c_str()).number() >= 0) return kind;
    return "run";
}

// Whether the work in a folder is done; false also if its files cannot be read yet.
bool has_ended(const Descriptor& run, const std::string& kind) {
    try {
        if (kind == "fit") return json_in(run, "fit.json").contains("parameters");
        if (kind == "sweep")
            return read_text_table(open_file(run, "sweep.csv").path()).rows.size() >=
                   json_in(run, "sweep.json").value("rows", std::size_t{0});
        return kind != "run" || open_file(run, "summary.json").number() >= 0;
    } catch (const std::exception&) {
        return false;
    }
}

std::string stamp_of(const Descriptor& run) {
    std::string stamp;
    for (const char* name : {"timeline.csv", "surface.pvd", "checkpoint.vdb", "summary.json", "sweep.csv",
                             "fit.csv", "fit.json"}) {
        struct stat file {};
        if (::fstatat(run.number(), name, &file, AT_SYMLINK_NOFOLLOW) == 0)
            stamp += fmt::format("{}.{}.{} ", file.st_size, file.st_mtim.tv_sec, file.st_mtim.tv_nsec);
    }
    return stamp;
}

// Total duration of the steps of an effective recipe, with repeats of loops; reads no file that it names.
double duration_in(const std::map<std::string, std::string>& keys) {
    double total = 0.0;
    for (const auto& [key, value] : keys) {
        if (!key.starts_with("step[") || !key.ends_with("].duration")) continue;
        double time = finite_number(value).value_or(0.0);
        for (std::size_t at = key.find(']'); at != std::string::npos; at = key.find(']', at + 1))
            if (const auto found = keys.find(key.substr(0, at + 1) + ".repeat"); found != keys.end())
                time *= finite_number(found->second).value_or(1.0);
        total += time;
    }
    return total;
}

Descriptor timeline_of(const Descriptor& run) {
    return open_file(run, "timeline.csv", std::numeric_limits<std::size_t>::max());
}

// Adds process time reached, total time and unit; leaves out what cannot be read.
void add_progress(const Descriptor& run, Json& json) {
    try {
        if (json["state"] == "finished") {
            const Json summary = json_in(run, "summary.json");
            json["time"] = json["total"] = summary.value("time", Json());
            json["unit"] = summary.value("time_unit", "");
            return;
        }
        const auto keys = written_keys(text_of(open_file(run, "recipe.toml")));
        json["total"] = duration_in(keys);
        json["unit"] = Json::parse(keys.at("domain.time_unit"));
        const Descriptor file = timeline_of(run);
        const TextTable timeline = last_of_timeline(file.path());
        const auto time = timeline.column("time");
        if (time && !timeline.rows.empty())
            json["time"] = finite_number(timeline.rows.back()[*time]).value_or(0.0);
    } catch (const std::exception&) {  // the run has just begun
    }
}

// A path for the command line: a name that begins with a dash is not taken for an option.
std::string plain_path(const std::string& name) {
    return "./" + name;
}

}  // namespace

ProcessEnd run_self(const std::vector<std::string>& arguments, int folder, const std::string& input) {
    static std::counting_semaphore<2> turn(2);
    struct Turn {
        Turn() { turn.acquire(); }
        ~Turn() { turn.release(); }
    } const mine;
    constexpr std::size_t kMost = 16'000'000;
    constexpr std::chrono::seconds kPatience{60};
    ChildProcess child(arguments, folder, input);
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    std::optional<ProcessEnd> end;
    while (!(end = child.end(kMost + 1))) {
        if (std::chrono::steady_clock::now() > deadline || interrupted()) child.stop(SIGKILL);
        std::this_thread::sleep_for(std::chrono::milliseconds(3));
    }
    if (std::max(end->output.size(), end->messages.size()) > kMost)
        throw IoError("sidewall {}: its output is over {} bytes: use the command line", arguments.front(),
                      kMost);
    return *std::move(end);
}

void start_program(const std::vector<std::string>& words, int folder, int log) {
    const Descriptor nothing(::open("/dev/null", O_RDWR | O_CLOEXEC));
    const int says = log < 0 ? nothing.number() : log;
    const std::lock_guard guard(started.lock);
    const pid_t process = start_process(words, folder, {nothing.number(), says, says}, true);
    if (process < 0) throw IoError("cannot start {}: {}", words.front(), std::string(std::strerror(errno)));
    started.processes.push_back(process);
}

void forget_ended() {
    const std::lock_guard guard(started.lock);
    std::erase_if(started.processes, [](pid_t process) { return ::waitpid(process, nullptr, WNOHANG) != 0; });
}

Json run_json(const OpenedFolder& folder, const std::string& name) {
    const Descriptor run = folder.folder(name);
    Json json{{"path", name}, {"kind", kind_of(run)}, {"stamp", stamp_of(run)}};
    const bool held = lock_holder(run.path()).has_value();
    json["state"] = held ? "running" : has_ended(run, json["kind"]) ? "finished" : "stopped";
    if (json["kind"] == "run") add_progress(run, json);
    return json;
}

Json table_json(const OpenedFolder& folder) {
    std::vector<RunRow> rows;
    for (const std::string& name : folder.contents().results) {
        try {
            const Descriptor run = folder.folder(name), timeline = timeline_of(run);
            rows.push_back(run_row(name, text_of(open_file(run, "recipe.toml")),
                                   text_of(open_file(run, "summary.json")), timeline.path()));
        } catch (const NotInside&) {  // removed since contents() was read
        }
    }
    return runs_table(rows);
}

std::vector<std::string> command_words(const OpenedFolder& folder, const Json& asked) {
    const std::string command = text_at(asked, "command"), recipe = text_at(asked, "recipe");
    if (command != "run" && command != "sweep" && command != "fit")
        throw RecipeError("{}: the page can start only run, sweep and fit", command);
    // Checks that the recipe exists; the plan of a resumed sweep names it with "./".
    folder.read(recipe.substr(recipe.starts_with("./") ? 2 : 0));
    std::vector<std::string> words{"sidewall", command, plain_path(recipe), "-o",
                                   plain_path(text_at(asked, "output"))};
    if (command == "run") words.emplace_back("--checkpoint-every=10");  // the page shows checkpoints
    if (const auto resume = asked.find("resume"); resume != asked.end() && *resume == true)
        words.emplace_back("--resume");
    for (const char* name : {"set", "vary", "target", "target_profile"}) {
        const auto list = asked.find(name);
        if (list == asked.end() || !list->is_array()) continue;
        const std::string option =
            std::string(name) == "target_profile" ? "--target-profile" : fmt::format("--{}", name);
        for (const Json& value : *list) {
            if (!value.is_string()) throw RecipeError("{}: must be a list of texts", name);
            if (option == "--target-profile") folder.read(value.get<std::string>());
            words.push_back(option + "=" + value.get<std::string>());
        }
    }
    return words;
}

void start_run(const OpenedFolder& folder, const Json& wanted) {
    Json asked = wanted;
    const std::string output = text_at(asked, "output"), command = text_at(asked, "command");
    if (command != "run" && asked.contains("resume") && asked["resume"] == true) {
        const Json plan = json_in(folder.folder(output), command + ".json");
        for (const char* key : {"recipe", "set", "vary", "target", "target_profile"})
            if (plan.contains(key)) asked[key] = plan[key];
    }
    const std::vector<std::string> words = command_words(folder, asked);
    folder.make_parent_folders(output);
    if (folder.holds(output)) folder.folder(output);
    const Descriptor log = folder.open_log(output + ".log");
    start_program(words, folder.folder("").number(), log.number());
}

bool stop_run(const OpenedFolder& folder, const std::string& name) {
    static const std::regex form(R"(^process (\d{1,9}) on (\S+), since )");
    std::array<char, 256> host{};
    std::smatch match;
    const std::string holder = lock_holder(folder.folder(name).path()).value_or("");
    if (::gethostname(host.data(), host.size() - 1) != 0 || !std::regex_search(holder, match, form) ||
        match[2] != host.data())
        return false;
    // The lock file may be stale: its process number may belong to another program by now.
    const auto program = [](const std::string& process) {
        std::error_code failure;
        const std::string name = fs::read_symlink("/proc/" + process + "/exe", failure).filename().string();
        return name.substr(0, name.find(" (deleted)"));  // the program was rebuilt
    };
    if (program(match[1]) != program("self")) return false;
    return ::kill(static_cast<pid_t>(std::stol(match[1])), SIGTERM) == 0;
}

}  // namespace sidewall::app
