#include "app/workbench/workbench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <regex>

#include "app/common/files.hpp"
#include "app/common/json.hpp"
#include "app/common/text.hpp"
#include "app/recipe/decks.hpp"
#include "app/recipe/sections.hpp"
#include "app/workbench/opened_folder.hpp"
#include "app/workbench/runs.hpp"
#include "app/workbench/workbench_page.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

// Requests that this process answers itself run one at a time, so that their memory does not add up.
std::unique_lock<std::mutex> own_turn() {
    static std::mutex turn;
    return std::unique_lock(turn);
}

std::string text_at_key(const Json& json, const char* key) {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_string()) throw NotInside(fmt::format("{} is missing", key));
    return found->get<std::string>();
}

WebReply reply_of(const Json& json) {
    return {.body = json.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

// The error in a recipe from the program's message, with its line and, for invalid TOML, its column.
Json problem_of(const std::string& messages) {
    static const std::regex form(
        R"(sidewall: (?:recipe:)?(?:(\d{1,9}): )?(?:(?=not valid TOML at column (\d{1,9}):))?)");
    const std::size_t at = messages.rfind("sidewall: ");
    std::string text = at == std::string::npos ? messages : messages.substr(at);
    std::smatch match;
    Json problem{{"line", nullptr}, {"column", nullptr}};
    if (std::regex_search(text, match, form, std::regex_constants::match_continuous)) {
        if (match[1].matched) problem["line"] = std::stol(match[1]);
        if (match[2].matched) problem["column"] = std::stol(match[2]);
        text = match.suffix();
    }
    problem["problem"] = trimmed(text.substr(0, text.find('\n')));
    return problem;
}

// What `check` prints after the effective recipe, without comment signs.
std::string findings_of(const std::string& output) {
    std::string text;
    for (const std::string& line :
         split(output.substr(std::min(output.find("# The grid:"), output.size())), '\n'))
        text +=
            (line.starts_with("# ") ? line.substr(2) : line.substr(std::min<std::size_t>(1, line.size()))) +
            "\n";
    return text;
}

std::string notes_of(const std::string& messages) {
    std::string text;
    for (const std::string& line : split(messages, '\n'))
        if (const auto at = line.find(": note: "); at != std::string::npos)
            text += line.substr(at + 2) + "\n";
    return text;
}

// Documentation of all sections and keys of recipes. The words of a key chemistry are the decks of its model.
Json keys_json(const Json& decks) {
    Json sections = Json::array();
    for (const SectionDoc& section : recipe_documentation()) {
        Json keys = Json::array();
        for (const KeyDoc& key : section.keys) {
            keys.push_back(
                Json{{"name", key.name}, {"type", type_line(key)}, {"doc", key.doc}, {"words", key.words}});
            if (key.name != "chemistry") continue;
            for (const auto& [deck, model] : decks.items())
                if (model == section.name) keys.back()["words"].push_back(deck);
        }
        sections.push_back(
            Json{{"name", section.name}, {"header", section.header}, {"doc", section.doc}, {"keys", keys}});
    }
    return sections;
}

std::vector<std::string> shipped_recipes() {
    std::vector<std::string> names;
    std::error_code failure;
    for (const auto& entry : fs::directory_iterator(shipped_folder("configs"), failure))
        if (entry.path().extension() == ".toml") names.push_back(entry.path().filename().string());
    std::ranges::sort(names);
    return names;
}

// The text and digest of a file of the folder, or of a recipe that came with the program (digest "").
WebReply text_reply(const OpenedFolder& folder, const WebRequest& request) {
    if (const auto shipped = request.query.find("shipped"); shipped != request.query.end()) {
        if (std::ranges::count(shipped_recipes(), shipped->second) == 0) throw NotInside("no shipped recipe");
        return reply_of({{"text", surface::read_whole_file(shipped_folder("configs") / shipped->second)},
                         {"digest", ""}});
    }
    const auto path = request.query.find("path");
    std::string text = folder.read(path == request.query.end() ? "" : path->second), now = digest(text);
    try {
        return {.body = Json{{"text", std::move(text)}, {"digest", std::move(now)}}.dump()};
    } catch (const Json::type_error&) {
        return reply_of(
            {{"problem",
              path->second +
                  ": is not in UTF-8 and would be damaged here: convert it, for example with iconv -f latin1 -t utf8"}});
    }
}

// The answer for a file that has changed since the page read it: its digest, "" if it was removed.
Json changed_json(const OpenedFolder& folder, const std::string& path) {
    std::string now;
    try {
        now = digest(folder.read(path));
    } catch (const NotInside&) {
    }
    return {{"problem", path + ": has changed on the disk since it was opened"},
            {"changed", true},
            {"digest", now}};
}

Json save(const OpenedFolder& folder, const Json& asked) {
    const std::string path = text_at_key(asked, "path"), text = text_at_key(asked, "text");
    if (!path.ends_with(".toml") && !path.ends_with(".csv"))
        return {{"problem", path + ": must end in .toml, or .csv for a profile"}};
    try {
        folder.make_parent_folders(path);
        folder.write(path, text, text_at_key(asked, "digest"));
    } catch (const ChangedOnDisk&) {
        return changed_json(folder, path);
    } catch (const IoError& error) {
        return {{"problem", error.what()}};
    }
    return {{"digest", digest(text)}};
}

// Starts the command that the page asks for; not if the recipe has another digest than the page gives.
Json start(const OpenedFolder& folder, const Json& asked) {
    if (asked.contains("digest")) {
        Json changed = changed_json(folder, text_at_key(asked, "recipe"));
        if (changed["digest"] != asked["digest"]) return changed;
    }
    start_run(folder, asked);
    return Json::object();
}

// The folder of the page's recipe, in which files that it names are sought; the opened folder if it does not
// exist yet.
Descriptor home_of(const OpenedFolder& folder, const Json& asked) {
    const std::string path = text_at_key(asked, "path");
    const std::size_t slash = path.rfind('/');
    try {
        return folder.folder(slash == std::string::npos ? "" : path.substr(0, slash));
    } catch (const NotInside&) {
        return folder.folder("");
    }
}

// The JSON that `sidewall report` prints in a folder, or the problem that it tells.
WebReply reported(const std::vector<std::string>& words, const Descriptor& folder, const std::string& input) {
    ProcessEnd said = run_self(words, folder.number(), input);
    if (said.exit_code != 0) return reply_of(problem_of(said.messages));
    return {.body = std::move(said.output)};
}

WebReply check(const OpenedFolder& folder, const Json& asked) {
    const Descriptor home = home_of(folder, asked);
    const ProcessEnd said = run_self({"check", "-"}, home.number(), text_at_key(asked, "text"));
    if (said.exit_code != 0) return reply_of(problem_of(said.messages));
    return reply_of({{"text", notes_of(said.messages) + findings_of(said.output)}});
}

// Names of the runs in a query; each folder is checked for links.
std::vector<std::string> runs_asked(const OpenedFolder& folder, const WebRequest& request) {
    const auto asked = request.query.find("run");
    if (asked == request.query.end()) throw NotInside("no run");
    std::vector<std::string> names = split(asked->second, '\0');
    for (const std::string& name : names) folder.refuse_links(name);
    return names;
}

WebReply results(const OpenedFolder& folder, const WebRequest& request) {
    std::vector<std::string> words{"report", "--json", "-"};
    if (request.query.contains("last")) words.emplace_back("--last");
    words.emplace_back("--");
    for (const std::string& name : runs_asked(folder, request)) words.push_back("./" + name);
    return reported(words, folder.folder(""), "");
}

Json contents_json(const OpenedFolder& folder, const std::string& first) {
    forget_ended();
    const OpenedFolder::Contents found = folder.contents();
    Json runs = Json::array();
    for (const std::string& name : found.results) {
        try {
            runs.push_back(run_json(folder, name));
        } catch (const NotInside&) {  // removed since contents() was read
        }
    }
    return {{"folder", folder.path().string()}, {"recipe", first}, {"recipes", found.recipes},
            {"tables", found.tables},           {"runs", runs},    {"cut", !found.whole}};
}

Json log_json(const OpenedFolder& folder, const WebRequest& request) {
    constexpr std::size_t kMost = 20'000;
    std::string text;
    try {
        const auto asked = request.query.find("run");
        text = folder.read_end(asked == request.query.end() ? "" : asked->second + ".log", kMost);
    } catch (const NotInside&) {
        text = "This run was not started from this page: there is no log of it.\n";
    }
    return {{"text", text}};
}

Json profile_json(const Json& asked) {
    constexpr std::size_t kMost = 200'000;
    const CsvTable table = parse_csv(text_at_key(asked, "text"), "the file", kMost / 2);
    if (table.columns.size() * table.columns.front().values.size() > kMost)
        throw FileError("the file: has over {} numbers: keep only two columns, x and z", kMost);
    Json columns = Json::array();
    for (const CsvColumn& column : table.columns)
        columns.push_back(Json{{"name", column.name}, {"unit", column.unit}, {"values", numbers_of(column)}});
    return {{"columns", columns}, {"understood", table.understood}};
}

WebReply got(const OpenedFolder& folder, const std::string& first, const WebRequest& request) {
    if (request.path == "/api/results") return results(folder, request);
    const auto turn = own_turn();
    if (request.path == "/") return {.type = "text/html; charset=utf-8", .body = workbench_html()};
    if (request.path == "/api/contents") return reply_of(contents_json(folder, first));
    if (request.path == "/api/table") return reply_of(table_json(folder));
    if (request.path == "/api/text") return text_reply(folder, request);
    if (request.path == "/api/keys") {
        Json decks = Json::object();
        for (const Deck& deck : shipped_decks()) decks[deck.name] = deck.model;
        return reply_of({{"sections", keys_json(decks)}, {"shipped", shipped_recipes()}, {"decks", decks}});
    }
    if (request.path == "/api/log") return reply_of(log_json(folder, request));
    throw NotInside("no such page");
}

WebReply posted(const OpenedFolder& folder, const std::string& path, const Json& asked) {
    if (path == "/api/preview")
        return reported({"report", "-", "--json", "-"}, home_of(folder, asked), text_at_key(asked, "text"));
    if (path == "/api/check") return check(folder, asked);
    const auto turn = own_turn();
    if (path == "/api/save") return reply_of(save(folder, asked));
    if (path == "/api/profile") return reply_of(profile_json(asked));
    if (path == "/api/start") return reply_of(start(folder, asked));
    if (path == "/api/stop") return reply_of({{"asked", stop_run(folder, text_at_key(asked, "run"))}});
    throw NotInside("no such page");
}

}  // namespace

WebReply workbench_reply(const WebRequest& request, const OpenedFolder& folder, const std::string& recipe) {
    try {
        if (request.method == "POST") {
            constexpr std::size_t kMostValues = 10'000;
            const Json asked = parse_json(request.body, kMostValues);
            if (!asked.is_object()) return {.status = 400, .type = "text/plain", .body = "not JSON\n"};
            return posted(folder, request.path, asked);
        }
        return got(folder, recipe, request);
    } catch (const NotInside& error) {
        return {
            .status = 404, .type = "text/plain; charset=utf-8", .body = fmt::format("{}\n", error.what())};
    } catch (const Error& error) {
        return reply_of({{"problem", error.what()}, {"line", nullptr}});
    }
}

}  // namespace sidewall::app
