#include <catch2/catch.hpp>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/run_program.hpp"

// Shell completion and the manual page come from the program's own tables: both must know every command and
// option that --help knows.
namespace {

using sidewall::test::config;
using sidewall::test::Folder;
using sidewall::test::Outcome;
using sidewall::test::run_program;

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

// First words of the entries under a heading of --help, at its two blanks of indentation.
std::vector<std::string> listed(const std::string& help, const std::string& heading) {
    std::vector<std::string> words;
    bool within = false;
    for (const std::string& line : lines_of(help)) {
        if (line.empty() || line[0] != ' ')
            within = line == heading + ":";
        else if (within && line.size() > 2 && line[2] != ' ')
            words.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
    return words;
}

std::vector<std::string> split_names(const std::string& names) {
    std::vector<std::string> list;
    std::istringstream in(names);
    for (std::string name; std::getline(in, name, ',');) list.push_back(name);
    return list;
}

std::string printed(const std::string& arguments) {
    const Folder folder;
    const Outcome outcome = run_program(folder.path, arguments);
    INFO(arguments << "\n" << outcome.output);
    CHECK(outcome.exit_code == 0);
    return outcome.output;
}

// Completions of the last of these words of a command line, in shell syntax; as for bash, without
// descriptions.
std::set<std::string> candidates(const std::string& words) {
    const std::vector<std::string> lines = lines_of(printed("completion bash -- " + words));
    return {lines.begin(), lines.end()};
}

bool installed(const std::string& tool) {
    return std::system(("command -v " + tool + " >/dev/null 2>&1").c_str()) == 0;
}

// Standard output and standard error of a command that reads \p text.
std::string piped(const std::string& command, const std::string& text) {
    const Folder folder;
    std::ofstream(folder.path / "in") << text;
    const std::string line = "cd '" + folder.path.string() + "' && " + command + " <in >out 2>&1";
    INFO(command);
    CHECK(std::system(line.c_str()) == 0);
    return sidewall::test::read_bytes(folder.path / "out");
}

const std::string kRecipe = config("quick/bosch_hole.toml");

}  // namespace

TEST_CASE("completion and the manual page know every command and option that --help lists") {
    const std::vector<std::string> commands = listed(printed("--help"), "Subcommands");
    REQUIRE(commands.size() >= 11);
    CHECK(candidates("''") == std::set<std::string>(commands.begin(), commands.end()));
    const std::string page = std::regex_replace(printed("man"), std::regex(R"(\\-)"), "-");
    for (const std::string& command : commands) {
        const std::string help = printed(command + " --help");
        const std::size_t begin = page.find("\n.SS " + command + " ");
        INFO(command);
        REQUIRE(begin != std::string::npos);
        const std::string section = page.substr(begin, page.find("\n.S", begin + 1) - begin);
        const std::set<std::string> offered = candidates(command + " -");
        for (const std::string& entry : listed(help, "Options"))
            for (const std::string& name : split_names(entry)) {
                INFO(name);
                CHECK(offered.contains(name));
                CHECK(std::regex_search(section, std::regex("\\\\fB[^\n]*" + name + "(,|\\\\fR)")));
            }
        for (const std::string& name : listed(help, "Positionals"))
            CHECK(section.find("\\fB" + name + "\\fR") != std::string::npos);
    }
}

TEST_CASE("a word is completed by what stands there: files, folders, models, methods, numbers by nothing") {
    using Words = std::set<std::string>;
    CHECK(candidates("run ''") == Words{":files"});
    CHECK(candidates("run x.toml -o ''") == Words{":folders"});
    CHECK(candidates("run x.toml --output=re") == Words{":folders"});
    CHECK(candidates("simplify ''") == Words{":files"});
    CHECK(candidates("simplify a.vtp --json ''") == Words{":files"});
    CHECK(candidates("inspect ''") == Words{":files"});  // folders are among them
    CHECK(candidates("run x.toml --threads ''").empty());
    CHECK(candidates("simplify a.vtp --method region") == Words{"region", "region-bounded"});
    CHECK(candidates("simplify --method=region-") == Words{"--method=region-bounded"});
    CHECK(candidates("study --surface ''") == Words{"1", "2", "all"});
    CHECK(candidates("flux a.vtp --boundary p") == Words{"periodic"});
    CHECK(candidates("models single") == Words{"single_particle"});
    CHECK(candidates("models lay") == Words{"layer"});
    CHECK(candidates("models chem") == Words{"chemistry"});
    CHECK(candidates("models chemistry cl_") == Words{"cl_ar_si", "cl_si", "cl_si_sheath"});
    CHECK(candidates("models layer cl_").empty());
    CHECK(candidates("completion ''") == Words{"bash", "fish", "zsh"});
    CHECK(candidates("run x.toml --qu") == Words{"--quiet"});
    CHECK(candidates("simplify --weights ''").empty());
    CHECK(candidates("simplify --weights 1,2,3 ''") == candidates("simplify ''"));
}

TEST_CASE("after --set the keys of the recipe named before it are offered, and the values they may have") {
    const std::set<std::string> keys = candidates("run " + kRecipe + " --set step");
    CHECK(keys.contains("step[0].repeat="));
    CHECK(keys.contains("step[0].steps[1].duration="));
    CHECK(keys.contains("step[0].steps[1].species[0].rate="));
    CHECK_FALSE(keys.contains("step[1].duration="));
    CHECK_FALSE(keys.contains("step[0].duration="));  // a loop has none
    const std::set<std::string> any = candidates("run missing.toml --set ''");
    CHECK(any.contains("step[0].duration="));
    CHECK(any.contains("layer[0].taper_deg="));
    CHECK(any.contains("flux.rays="));
    CHECK(candidates("anneal x.toml --set flux.").empty());  // no such command
    CHECK(candidates("check " + kRecipe + " --set simplify.method=reg") ==
          std::set<std::string>{"simplify.method=region", "simplify.method=region-bounded"});
    CHECK(candidates("check " + kRecipe + " --set step[0].steps[0].deposit=Si3") ==
          std::set<std::string>{"step[0].steps[0].deposit=Si3N4"});
    CHECK(candidates("check " + kRecipe + " --set step[0].steps[1].chemistry=bosch_e") ==
          std::set<std::string>{"step[0].steps[1].chemistry=bosch_etch"});
    CHECK(printed("completion fish -- check " + kRecipe + " --set metrology.mask") ==
          "metrology.mask_bottom=\tz of the mask's underside, below which undercut is measured (length)\n");
    CHECK(printed("completion zsh -- check " + kRecipe + " --set metrology.mask") ==
          "metrology.mask_bottom=:z of the mask's underside, below which undercut is measured (length)\n");
}

TEST_CASE("bash completes what its function is asked for, words taken apart at = as bash does") {
    const Folder folder;
    // One line an answer. Outside of a completion compopt is refused.
    std::ofstream(folder.path / "ask.bash") << R"(
source <("$1" completion bash)
complete -p sidewall
compopt() { COMPREPLY+=("<$*>"); }
ask() {
    COMP_WORDS=("$program" "$@") COMP_CWORD=$#
    local typed=${COMP_WORDS[-1]}
    [[ $typed == = ]] && typed=
    _sidewall sidewall "$typed" "${COMP_WORDS[-2]}"
    echo "${COMPREPLY[*]}"
}
program=$1
ask ins
ask simplify mesh.vtp --method region
ask run "'my recipe.toml'" -o re
ask run x.
ask run x.toml --set simplify.method = region-
ask run x.toml --set simplify.method =
ask run x.toml --set flux.av
ask simplify --method = cg
ask nothing ''
)";
    const Outcome outcome =
        run_program(folder.path, "--version >/dev/null; bash ask.bash '" SIDEWALL_PROGRAM "'");
    CHECK(outcome.exit_code == 0);
    CHECK(lines_of(outcome.output) ==
          std::vector<std::string>{"complete -F _sidewall sidewall", "inspect", "region region-bounded",
                                   "<-o dirnames>", "<-o default>", "region-bounded",
                                   "auto none lindstrom-turk region region-bounded cgal-lindstrom-turk",
                                   "<-o nospace> flux.averaging=", "cgal-lindstrom-turk", ""});
}

TEST_CASE(
    "the shells' scripts and the manual page are read without complaint where there is someone to read them") {
    for (const std::string shell : {"bash", "zsh", "fish"}) {
        const std::string script = printed("completion " + shell);
        CHECK(script.find("completion " + shell + " -- ") != std::string::npos);
        INFO(shell);
        if (installed(shell)) CHECK(piped(shell + " -n", script).empty());
    }
    const std::string page = printed("man");
    for (const char* part :
         {".SH NAME\nsidewall \\- ", ".SH SYNOPSIS", ".SH RECIPES", ".SS [simplify]\n",
          "\\fBtaper_deg\\fR (number, degree, default 0.0)", ".SH EXIT STATUS", "\\fB130\\fR"})
        CHECK(page.find(part) != std::string::npos);
    if (installed("groff")) {
        CHECK(piped("groff -man -ww -Tutf8 -z", page).empty());
        CHECK(piped("groff -man -Tascii -P-cbou", page).find("--feature-parameter C|auto") !=
              std::string::npos);
    }
    const Folder folder;
    CHECK(run_program(folder.path, "completion csh").exit_code == 2);
}
