#include <fmt/format.h>

#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <memory>

#include "app/commands/cli_options.hpp"
#include "app/common/text.hpp"
#include "app/recipe/decks.hpp"
#include "app/recipe/recipe.hpp"
#include "app/recipe/sections.hpp"

// Completion in shells. The script that a shell loads knows no commands: at every Tab it passes the words
// typed so far to the program, which answers from its own tables of commands and options.
namespace sidewall::app {
namespace {

const char* const kBash =
    R"(# Completion for sidewall in bash. In ~/.bashrc: source <(sidewall completion bash)
_sidewall() {
    local i line word words=()
    COMPREPLY=()
    # Bash keeps quotes, and takes words apart at = and :
    for ((i = 0; i <= COMP_CWORD; ++i)); do
        word=${COMP_WORDS[i]//[\"\'\\]/}
        if ((i > 1)) && [[ $word == [=:]* || ${COMP_WORDS[i - 1]} == *[=:] ]]; then
            words[-1]+=$word
        else
            words+=("$word")
        fi
    done
    local kept=${words[-1]%"$2"}  # the part of the word that bash does not replace
    while IFS= read -r line; do
        case $line in
            :files) compopt -o default ;;
            :folders) compopt -o dirnames ;;
            *=) compopt -o nospace; COMPREPLY+=("${line#"$kept"}") ;;
            *) COMPREPLY+=("${line#"$kept"}") ;;
        esac
    done < <("${words[0]/#\~\//$HOME/}" completion bash -- "${words[@]:1}" 2>/dev/null)
}
complete -F _sidewall sidewall
)";

const char* const kZsh = R"(#compdef sidewall
# Completion for sidewall in zsh. In ~/.zshrc, after compinit: source <(sidewall completion zsh)
compdef _sidewall sidewall
_sidewall() {
    local line program=${(Q)words[1]}
    local -a open closed
    for line in "${(@f)$("${program/#\~\//$HOME/}" completion zsh -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)}"; do
        case $line in
            :files) compset -P '--*='; _files; return ;;
            :folders) compset -P '--*='; _files -/; return ;;
            *=:*) open+=("$line") ;;
            ?*) closed+=("$line") ;;
        esac
    done
    _describe sidewall open -S '' -- closed
}
# The file itself may stand in $fpath under the name _sidewall.
if [[ ${funcstack[1]} == _sidewall ]]; then _sidewall; fi
)";

const char* const kFish =
    R"(# Completion for sidewall in fish. In ~/.config/fish/config.fish: sidewall completion fish | source
function __sidewall_complete
    set -l typed (commandline -opc)
    set -l program (string replace -r -- '^~/' "$HOME/" $typed[1])
    set -l word (commandline -ct)
    set -l option (string match -r -- '^--[^=]*=' "$word")
    set -l value (string replace -r -- '^--[^=]*=' '' "$word")
    for line in ($program completion fish -- $typed[2..-1] "$word" 2>/dev/null)
        switch $line
            case ':files'
                printf '%s\n' "$option"(__fish_complete_path "$value")
            case ':folders'
                printf '%s\n' "$option"(__fish_complete_directories "$value")
            case '*'
                printf '%s\n' $line
        end
    end
end
complete -c sidewall -f -a '(__sidewall_complete)'
)";

struct Candidate {
    std::string word, doc;
};

/// Completions of a word: these words, or files or folders, which the shell finds itself.
struct Offer {
    std::vector<Candidate> words;
    bool files = false, folders = false;
};

/// The command line before the word to complete.
struct Before {
    std::vector<std::string> arguments;   ///< positional arguments
    const CLI::Option* option = nullptr;  ///< the option whose value is completed; null: none
    bool options_ended = false;           ///< "--" was given
};

bool looks_like_option(const std::string& word) {
    return word.size() > 1 && word[0] == '-';
}

Before read_before(const CLI::App& command, const std::vector<std::string>& words) {
    Before before;
    int open = 0;  // values that the last option may still take
    for (const std::string& word : words) {
        if (!before.options_ended && looks_like_option(word)) {
            before.options_ended = word == "--";
            before.option = command.get_option_no_throw(word);  // null for --name=value
            open = before.option != nullptr ? before.option->get_items_expected_max() : 0;
        } else if (open > 0) {
            --open;
        } else {
            before.arguments.push_back(word);
        }
        if (open == 0) before.option = nullptr;
    }
    return before;
}

/// Keys of the recipe that the first argument names, or of any recipe.
std::vector<KeyDoc> recipe_keys(const std::vector<std::string>& arguments) {
    try {
        if (!arguments.empty()) return settable_keys(load_recipe(arguments[0]));
    } catch (const std::exception&) {  // recipe missing or half written: offer all keys
    }
    return settable_keys();
}

std::vector<Candidate> deck_words() {
    std::vector<Candidate> list;
    for (const Deck& deck : shipped_decks()) list.push_back({deck.name, deck.title});
    return list;
}

std::vector<Candidate> settings(const std::vector<KeyDoc>& keys, const std::string& word) {
    std::vector<Candidate> list;
    const auto equals = word.find('=');
    for (const KeyDoc& key : keys) {
        if (equals == std::string::npos)
            list.push_back({key.name + "=", key.unit.empty() ? key.doc : key.doc + " (" + key.unit + ")"});
        if (key.name != word.substr(0, equals)) continue;
        for (const std::string& value : key.words) list.push_back({key.name + "=" + value, key.doc});
        if (key.name.ends_with(".chemistry"))
            for (const auto& [deck, title] : deck_words()) list.push_back({key.name + "=" + deck, title});
    }
    return list;
}

std::vector<Candidate> model_words() {
    std::vector<Candidate> list{{"chemistry", "decks of numbers with sources"}};
    for (const SectionDoc& section : recipe_documentation()) {
        const std::string word = section.name.substr(0, section.name.find(' '));  // "layer" of each shape
        if (list.empty() || list.back().word != word) list.push_back({word, section.doc});
    }
    return list;
}

/// Completions by the type of an option's value (cli_options.hpp).
Offer values(const CLI::Option& option, const Before& before, const std::string& word) {
    Offer offer;
    const std::string type = option.get_type_name();
    const auto open = type.find('{'), close = type.find('}');
    if (open < close && close != std::string::npos)
        for (const std::string& value : split(type.substr(open + 1, close - open - 1), ','))
            offer.words.push_back({value, ""});
    for (const std::string& part : split(type, '|')) {
        if (part == "MESH" || part.starts_with("FILE")) offer.files = true;
        if (part == "DIR") offer.folders = true;
        if (part == "MODEL") offer.words = model_words();
        if (part == "CHEMISTRY" && before.arguments == std::vector<std::string>{"chemistry"})
            offer.words = deck_words();
        if (part.starts_with("KEY=")) offer.words = settings(recipe_keys(before.arguments), word);
    }
    return offer;
}

Offer option_names(const CLI::App& command) {
    Offer offer;
    for (const CLI::Option* option : command.get_options()) {
        for (const std::string& name : option->get_lnames())
            offer.words.push_back({"--" + name, option->get_description()});
        for (const std::string& name : option->get_snames())
            offer.words.push_back({"-" + name, option->get_description()});
    }
    return offer;
}

/// Completions of the last of the words after a subcommand.
Offer offer_argument(const CLI::App& command, const std::vector<std::string>& words) {
    const std::string& word = words.back();
    const Before before = read_before(command, {words.begin(), words.end() - 1});
    if (before.option != nullptr && !looks_like_option(word)) return values(*before.option, before, word);
    if (const auto equals = word.find('=');
        !before.options_ended && word.starts_with("--") && equals < word.size()) {
        const std::string name = word.substr(0, equals);
        const CLI::Option* option = command.get_option_no_throw(name);
        if (option == nullptr) return {};
        Offer offer = values(*option, before, word.substr(equals + 1));
        for (Candidate& candidate : offer.words) candidate.word = name + "=" + candidate.word;
        return offer;
    }
    if (!before.options_ended && word.starts_with("-")) return option_names(command);
    const auto positionals = command.get_options([](const CLI::Option* o) { return o->get_positional(); });
    if (before.arguments.size() < positionals.size())
        return values(*positionals[before.arguments.size()], before, word);
    return before.options_ended ? Offer() : option_names(command);
}

/// Completions of the last word.
/// \pre there is a word.
Offer offer_for(const CLI::App& program, const std::vector<std::string>& words) {
    const auto commands = program.get_subcommands([](const CLI::App*) { return true; });
    if (words.size() > 1) {
        const auto command =
            std::ranges::find(commands, words[0], [](const CLI::App* c) { return c->get_name(); });
        return command == commands.end() ? Offer()
                                         : offer_argument(**command, {words.begin() + 1, words.end()});
    }
    if (words[0].starts_with("-")) return option_names(program);
    Offer offer;
    for (const CLI::App* command : commands)
        offer.words.push_back({command->get_name(), command->get_description()});
    return offer;
}

/// Prints a line for each candidate, in the form that the shell's script reads.
void print_offer(const Offer& offer, const std::string& shell, const std::string& word) {
    for (const auto& [candidate, doc] : offer.words) {
        if (!candidate.starts_with(word)) continue;
        const std::string line = boost::replace_all_copy(doc, "\n", " ");
        if (shell == "bash") fmt::print("{}\n", candidate);
        if (shell == "zsh") fmt::print("{}:{}\n", boost::replace_all_copy(candidate, ":", "\\:"), line);
        if (shell == "fish") fmt::print("{}\t{}\n", candidate, line);
    }
    if (offer.files || offer.folders) fmt::print("{}\n", offer.files ? ":files" : ":folders");
}

}  // namespace

void add_completion_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "completion",
        "Print a script that completes commands, options, files and recipe keys at the Tab key:\n"
        "source <(sidewall completion bash), the same for zsh, or sidewall completion fish | source");
    const auto shell = std::make_shared<std::string>();
    const auto words = std::make_shared<std::vector<std::string>>();
    add_option(command, "SHELL", *shell, "", "Which shell the script is for",
               {.required = true, .one_of = {"bash", "zsh", "fish"}});
    add_option(command, "WORD", *words, "TEXT",
               "Words of a command line, after --: print completions of the last one, for the script");
    command.callback([&program, shell, words] {
        if (words->empty())
            fmt::print("{}", *shell == "bash" ? kBash : *shell == "zsh" ? kZsh : kFish);
        else
            print_offer(offer_for(program, *words), *shell, words->back());
    });
}

}  // namespace sidewall::app
