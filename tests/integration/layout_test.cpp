#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <vector>

// The layout of the sources that design and README describe, checked by the sources' own includes.
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = SIDEWALL_SOURCE_DIR;

// What each library may include besides itself.
const std::map<std::string, std::vector<std::string>> kLibraries = {
    {"surface", {}},
    {"levelset", {"surface"}},
    {"simplify", {"surface"}},
    {"flux", {"surface"}},
    {"app", {"surface", "levelset", "simplify", "flux"}},
};

// The folders of app/: each may include those to its left.
const std::vector<std::string> kRooms = {
    "common", "schema", "models",   "recipe",     "results", "process",   "pictures", "devices",
    "sweep",  "fit",    "accuracy", "evaluation", "report",  "workbench", "commands", "python"};

struct Include {
    std::string from, to;  // paths from the root
};

std::vector<fs::path> sources(const std::string& folder) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder))
        if (entry.path().extension() == ".hpp" || entry.path().extension() == ".cpp")
            files.push_back(entry.path());
    return files;
}

std::vector<Include> includes(const std::string& folder) {
    std::vector<Include> list;
    for (const fs::path& file : sources(folder)) {
        std::ifstream in(file);
        const std::string directive = "#include \"";
        for (std::string line; std::getline(in, line);)
            if (line.starts_with(directive))
                list.push_back({fs::relative(file, kRoot).string(),
                                line.substr(directive.size(), line.rfind('"') - directive.size())});
    }
    return list;
}

// The statements of a source that begin in the first column, outside of unnamed namespaces, up to their ';'
// or '{'.
std::vector<std::string> statements(const fs::path& file) {
    std::vector<std::string> list;
    std::ifstream in(file);
    std::string statement;
    bool unnamed = false;
    for (std::string line; std::getline(in, line);) {
        if (line == "namespace {") unnamed = true;
        if (line == "}  // namespace") unnamed = false;
        if (unnamed || line.starts_with("namespace")) continue;
        line = line.substr(0, line.find("//"));
        while (!line.empty() && line.back() == ' ') line.pop_back();
        if (line.empty() || line[0] == '#' || (statement.empty() && (line[0] == ' ' || line[0] == '}')))
            continue;
        statement += line;
        if (line.back() == ';' || line.back() == '{') {
            list.push_back(statement);
            statement.clear();
        }
    }
    return list;
}

// The name, with its class if it is a member's, of the function that a statement declares or defines, else
// empty.
std::string function_name(const std::string& statement) {
    static const std::regex form(R"(^(?:template <.*?> ?)?[\w:<>,&*\[\] ]*?[ &*]((?:\w+::)*~?\w+)\()");
    static const std::regex other(
        R"(^(?:using|class|struct|enum|static|typedef|inline constexpr|constexpr)\b)");
    std::smatch match;
    if (std::regex_search(statement, other) || !std::regex_search(statement, match, form)) return {};
    return match[1];
}

// The classes and structures that a header defines.
std::vector<std::string> types(const fs::path& file) {
    static const std::regex form(R"(^ *(?:class|struct) (\w+)(?: final)?(?: : .*)? \{)");
    std::vector<std::string> list;
    std::ifstream in(file);
    std::smatch match;
    for (std::string line; std::getline(in, line);)
        if (std::regex_search(line, match, form)) list.push_back(match[1]);
    return list;
}

std::string part(const std::string& path, int index) {
    const fs::path names(path);
    return std::next(names.begin(), index)->string();
}

// Index in kRooms of a path's folder; none for files in app/ itself.
std::optional<std::ptrdiff_t> room(const std::string& path) {
    const auto found = std::find(kRooms.begin(), kRooms.end(), part(path, 1));
    return found == kRooms.end() ? std::nullopt : std::optional(found - kRooms.begin());
}

}  // namespace

TEST_CASE("no include runs upward between the libraries") {
    for (const auto& [folder, allowed] : kLibraries) {
        const std::vector<Include> list = includes(folder);
        CHECK(list.size() > 10);
        for (const Include& include : list) {
            CAPTURE(include.from, include.to);
            CHECK(fs::exists(kRoot / include.to));
            const std::string to = part(include.to, 0);
            CHECK((to == folder || std::find(allowed.begin(), allowed.end(), to) != allowed.end()));
        }
    }
}

TEST_CASE("no include runs upward between the rooms of app/") {
    for (const Include& include : includes("app")) {
        CAPTURE(include.from, include.to);
        const auto from = room(include.from);
        if (!from) {
            CHECK(include.from == "app/main.cpp");  // the only source in app/ itself
        } else if (part(include.to, 0) == "app") {
            const auto to = room(include.to);
            REQUIRE(to);
            CHECK(*to <= *from);
        }
    }
}

TEST_CASE("OpenVDB is named in levelset/ and in the extraction of surface/ alone, CGAL in simplify/") {
    const auto named = [](const std::string& folder, const std::string& text) {
        std::vector<std::string> files;
        for (const fs::path& file : sources(folder)) {
            std::ifstream in(file);
            for (std::string line; std::getline(in, line);)
                if (line.starts_with(text) && line != "#include <openvdb/version.h>") {
                    files.push_back(fs::relative(file, kRoot).string());
                    break;
                }
        }
        return files;
    };
    CHECK(named("levelset", "#include <openvdb/").size() > 3);
    for (const char* folder : {"simplify", "flux", "app"}) CHECK(named(folder, "#include <openvdb/").empty());
    for (const std::string& file : named("surface", "#include <openvdb/"))
        CHECK(file.starts_with("surface/extraction/"));
    CHECK_FALSE(named("simplify", "#include <CGAL/").empty());
    for (const char* folder : {"surface", "levelset", "flux", "app"})
        CHECK(named(folder, "#include <CGAL/").empty());
}

TEST_CASE("files are written in surface/files/output_file.cpp alone, which notices what a disk refuses") {
    for (const auto& [folder, allowed] : kLibraries)
        for (const fs::path& file : sources(folder)) {
            if (file.stem() == "output_file") continue;
            std::ifstream in(file);
            for (std::string line; std::getline(in, line);)
                for (const char* writer : {"ofstream", "std::fstream", "fopen(", "io::File "}) {
                    CAPTURE(file.string(), line);
                    CHECK(line.find(writer) == std::string::npos);
                }
        }
}

TEST_CASE("a source of the product has one subject: no more than 400 lines") {
    for (const auto& [folder, allowed] : kLibraries)
        for (const fs::path& file : sources(folder)) {
            std::ifstream in(file);
            std::size_t lines = 0;
            for (std::string line; std::getline(in, line);) ++lines;
            CAPTURE(file.string());
            CHECK(lines <= 400);
        }
}

TEST_CASE("no header name occurs twice in the tree") {
    std::map<std::string, std::string> of;
    for (const char* folder : {"surface", "levelset", "simplify", "flux", "app", "tests"})
        for (const fs::path& file : sources(folder)) {
            if (file.extension() != ".hpp") continue;
            const std::string path = fs::relative(file, kRoot).string();
            const auto [other, is_new] = of.try_emplace(file.filename().string(), path);
            CAPTURE(path, other->second);
            CHECK(is_new);
        }
    CHECK(of.size() > 200);
}

TEST_CASE("a function is defined in the source whose header declares it") {
    // Stems of the headers that declare a name, by library and name; a member's name has its class before it.
    std::map<std::string, std::set<std::string>> declared;
    std::vector<std::array<std::string, 2>> defined;  // key as above, stem
    for (const auto& [folder, allowed] : kLibraries)
        for (const fs::path& file : sources(folder)) {
            const bool header = file.extension() == ".hpp";
            const std::string stem = fs::relative(file, kRoot).replace_extension().string();
            for (const std::string& statement : statements(file)) {
                const std::string name = function_name(statement);
                if (name.empty() || statement.back() != (header ? ';' : '{')) continue;
                if (header) declared[folder + " " + name].insert(stem);
                if (!header) defined.push_back({folder + " " + name, stem});
            }
            if (header)
                for (const std::string& type : types(file)) declared[folder + " " + type + "::"].insert(stem);
        }
    std::vector<std::string> elsewhere;
    for (const auto& [key, stem] : defined) {
        const std::size_t member = key.rfind("::");
        const auto found = declared.find(member == std::string::npos ? key : key.substr(0, member + 2));
        if (found == declared.end() || found->second.contains(stem)) continue;
        elsewhere.push_back(key + " is defined in " + stem + ".cpp");
    }
    CHECK(defined.size() > 500);
    CAPTURE(elsewhere);
    CHECK(elsewhere.size() <= 15);
}

TEST_CASE("a public comment begins with a sentence of its own") {
    std::size_t comments = 0;
    for (const auto& [folder, allowed] : kLibraries)
        for (const fs::path& file : sources(folder)) {
            if (file.extension() != ".hpp") continue;
            std::ifstream in(file);
            bool goes_on = false;  // a line of a comment that began above
            for (std::string line; std::getline(in, line);) {
                const std::size_t at = line.find_first_not_of(' ');
                const bool comment = at != std::string::npos && line.compare(at, 4, "/// ") == 0;
                if (comment && !goes_on) {
                    ++comments;
                    CAPTURE(file.string(), line);
                    for (const char* word : {"Of ", "As ", "That ", "Which ", "The same ", "Whose ", "And "})
                        CHECK(line.compare(at + 4, std::strlen(word), word) != 0);
                }
                goes_on = comment;
            }
        }
    CHECK(comments > 500);
}

// A release build compiles the sources of a folder together. A constant in one source's unnamed namespace
// would hide that of a header in all of them, and give them another value than sources compiled alone have.
TEST_CASE("no source's own constant has the name of one in a header of its folder") {
    const std::regex constant(R"(^(?:inline |static )?constexpr [^=(]*\b(k[A-Z]\w*))");
    std::map<std::string, std::map<std::string, std::string>> of_header,
        of_source;  // file by name, by folder
    for (const auto& [folder, allowed] : kLibraries)
        for (const fs::path& file : sources(folder)) {
            auto& names = (file.extension() == ".hpp" ? of_header : of_source)[file.parent_path().string()];
            std::ifstream in(file);
            std::smatch match;
            for (std::string line; std::getline(in, line);)
                if (std::regex_search(line, match, constant)) names[match[1]] = file.filename().string();
        }
    std::size_t compared = 0;
    for (const auto& [folder, names] : of_source)
        for (const auto& [name, file] : names) {
            CAPTURE(folder, name, file);
            CHECK(!of_header[folder].contains(name));
            ++compared;
        }
    CHECK(compared > 100);
}
