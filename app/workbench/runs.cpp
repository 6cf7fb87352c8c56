#include "app/workbench/runs.hpp"

#include <fmt/format.h>

#include <sys/stat.h>
#include <unistd.h>
#include <array>
#include <csignal>
#include <regex>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/recipe/recipe.hpp"
#include "app/report/parts.hpp"
#include "app/results/result.hpp"
#include "app/workbench/launch.hpp"

namespace sidewall::app {
namespace {

std::string kind_of(const fs::path& run) {
    for (const char* kind : {"sweep", "fit", "compare", "study", "validation"})
        if (is_there(run / fmt::format("{}.json", kind))) return kind;
    return "run";
}

// Whether the work in a folder is done; one that cannot be read yet is not.
bool has_ended(const fs::path& run, const std::string& kind) {
    try {
        if (kind == "fit") return read_json(run / "fit.json", "").contains("parameters");
        if (kind == "sweep")
            return read_text_table(run / "sweep.csv").rows.size() >=
                   read_json(run / "sweep.json", "").value("rows", std::size_t{0});
        return kind != "run" || is_there(run / "summary.json");
    } catch (const std::exception&) {
        return false;
    }
}

std::string stamp_of(const fs::path& run) {
    std::string stamp;
    for (const char* name : {"timeline.csv", "surface.pvd", "checkpoint.vdb", "summary.json", "sweep.csv",
                             "fit.csv", "fit.json"}) {
        struct stat file {};
        if (::stat((run / name).c_str(), &file) == 0)
            stamp += fmt::format("{}.{}.{} ", file.st_size, file.st_mtim.tv_sec, file.st_mtim.tv_nsec);
    }
    return stamp;
}

// How far a run has come; what cannot be read leaves it out.
void add_progress(const fs::path& run, Json& json) {
    try {
        if (json["state"] == "finished") {
            const Json summary = read_summary(run);
            json["time"] = json["total"] = summary.value("time", Json());
            json["unit"] = summary.value("time_unit", "");
            return;
        }
        const Recipe recipe = load_recipe(run / "recipe.toml");
        json["total"] = total_duration(expanded_steps(recipe));
        json["unit"] = recipe.domain.time_unit;
        const TextTable timeline = last_of_timeline(run);
        const auto time = timeline.column("time");
        if (time && !timeline.rows.empty())
            json["time"] = finite_number(timeline.rows.back()[*time]).value_or(0.0);
    } catch (const std::exception&) {  // it has just begun
    }
}

std::string text_of(const Json& asked, const char* key) {
    const auto found = asked.find(key);
    return found != asked.end() && found->is_string() ? found->get<std::string>() : "";
}

// As the command line gets it: no option, whatever its name begins with.
std::string plain_path(const std::string& name) {
    return "./" + name;
}

}  // namespace

Json run_json(const OpenedFolder& folder, const std::string& name) {
    const fs::path run = folder.inside(name);
    Json json{{"path", name}, {"kind", kind_of(run)}, {"stamp", stamp_of(run)}};
    const bool held = lock_holder(run).has_value();
    json["state"] = held ? "running" : has_ended(run, json["kind"]) ? "finished" : "stopped";
    if (json["kind"] == "run") add_progress(run, json);
    return json;
}

std::vector<std::string> command_words(const OpenedFolder& folder, const Json& asked) {
    const std::string command = text_of(asked, "command"), recipe = text_of(asked, "recipe");
    if (command != "run" && command != "sweep" && command != "fit")
        throw RecipeError("{}: the page starts run, sweep and fit", command);
    folder.read(recipe);
    std::vector<std::string> words{"sidewall", command, plain_path(recipe), "-o",
                                   plain_path(text_of(asked, "output"))};
    if (command == "run") words.emplace_back("--checkpoint-every=10");  // the page shows them
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

void start_run(const OpenedFolder& folder, const Json& asked) {
    const std::vector<std::string> words = command_words(folder, asked);
    const std::string output = text_of(asked, "output");
    folder.make_room_for(output);
    std::error_code failure;
    if (fs::symlink_status(folder.path() / output, failure).type() != fs::file_type::not_found)
        folder.inside(output);
    const Descriptor log = folder.open_log(output + ".log");
    start_program(words, folder.path(), log.number());
}

bool stop_run(const OpenedFolder& folder, const std::string& name) {
    static const std::regex form(R"(^process (\d{1,9}) on (\S+), since )");
    std::array<char, 256> host{};
    std::smatch match;
    const std::string holder = lock_holder(folder.inside(name)).value_or("");
    if (::gethostname(host.data(), host.size() - 1) != 0 || !std::regex_search(holder, match, form) ||
        match[2] != host.data())
        return false;
    // The file says a number; only a process of this program is meant.
    const auto program = [](const std::string& process) {
        std::error_code failure;
        const std::string name = fs::read_symlink("/proc/" + process + "/exe", failure).filename().string();
        return name.substr(0, name.find(" (deleted)"));  // it has been built anew since
    };
    if (program(match[1]) != program("self")) return false;
    return ::kill(static_cast<pid_t>(std::stol(match[1])), SIGTERM) == 0;
}

}  // namespace sidewall::app
