#include "app/models/expression.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <muParser.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <limits>

#include "app/schema/keys.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

bool begins_name(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

bool in_name(char c) {
    return begins_name(c) || (c >= '0' && c <= '9');
}

// Calls use(begin, end) for each identifier until it returns true, and returns whether it did. Exponents such
// as the e of 1e5 are no identifiers.
template <class Use>
bool any_name(std::string_view text, Use&& use) {
    for (std::size_t i = 0; i < text.size();) {
        std::size_t end = i;
        if (begins_name(text[i])) {
            while (end < text.size() && in_name(text[end])) ++end;
            if (use(i, end)) return true;
        } else if ((text[i] >= '0' && text[i] <= '9') || text[i] == '.') {
            while (end < text.size() && (in_name(text[end]) || text[end] == '.')) ++end;
        } else {
            ++end;
        }
        i = end;
    }
    return false;
}

// Position and text for a message: "character 7, \"G*(1 - t)\"". Counted from 1.
std::string place_in(std::string_view text, std::size_t at) {
    constexpr std::size_t kShown = 24;
    const std::string_view rest = text.substr(std::min(at - 1, text.size()));
    if (rest.empty()) return fmt::format("character {}, its end", text.size());
    return fmt::format("character {}, \"{}{}\"", at, rest.substr(0, kShown),
                       rest.size() > kShown ? "..." : "");
}

bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

// muParser wants a function's bracket right after its name. Blanks between them move before the name, which
// keeps the positions of everything else.
std::string with_brackets_close(std::string text, const std::vector<std::string>& functions) {
    const std::string written = text;
    any_name(written, [&](std::size_t begin, std::size_t end) {
        std::size_t open = end;
        while (open < written.size() && is_blank(written[open])) ++open;
        const std::string name = written.substr(begin, end - begin);
        if (open < written.size() && written[open] == '(' &&
            std::find(functions.begin(), functions.end(), name) != functions.end())
            text.replace(begin, open - begin, std::string(open - end, ' ') + name);
        return false;
    });
    return text;
}

std::size_t position_of(std::string_view text, std::string_view name) {
    std::size_t at = 0;
    any_name(text, [&](std::size_t begin, std::size_t end) {
        at = begin;
        return text.substr(begin, end - begin) == name;
    });
    return at + 1;
}

// Refuses assignments, which muParser would carry out.
void refuse_assignment(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '=') continue;
        if (i + 1 < text.size() && text[i + 1] == '=') {
            ++i;
            continue;
        }
        if (i > 0 && (text[i - 1] == '<' || text[i - 1] == '>' || text[i - 1] == '!')) continue;
        throw ExpressionError("{}: an expression cannot assign a value; compare with ==",
                              place_in(text, i + 1));
    }
}

mu::Parser bare_parser() {
    mu::Parser parser;
    parser.ClearConst();  // removes _pi and _e
    return parser;
}

double look_up(void* table, double a) {
    return (*static_cast<const Table*>(table))(a);
}

double look_up_in_two(void* table, double a, double b) {
    return (*static_cast<const Table*>(table))(a, b);
}

std::string list_of(const std::vector<std::string>& names) {
    return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

// A muParser error in words that tell a recipe's author what to change.
std::string reason(const mu::ParserError& error, const std::string& text,
                   const std::vector<std::string>& names, const std::vector<std::string>& functions) {
    const std::string& token = error.GetToken();
    if (error.GetCode() == mu::ecUNASSIGNABLE_TOKEN && !token.empty() && begins_name(token[0])) {
        // muParser's token extends over all characters that may be part of a name.
        std::size_t end = 0;
        while (end < token.size() && in_name(token[end])) ++end;
        const std::string name = token.substr(0, end);
        const std::size_t at = position_of(text, name);
        const std::size_t after = text.find_first_not_of(' ', at - 1 + name.size());
        const bool call = after != std::string::npos && text[after] == '(';
        const std::vector<std::string>& known = call ? functions : names;
        return fmt::format("{}: unknown {} {}{} {}: {}", place_in(text, at), call ? "function" : "name", name,
                           did_you_mean("; ", name, known, ";"), call ? "functions" : "it may use",
                           list_of(known));
    }
    std::string message = error.GetMsg();
    for (const char* where : {" found at position ", " at expression position ", " at position "})
        message.resize(std::min(message.find(where), message.size()));  // positions counted from 0
    while (!message.empty() && (message.back() == '.' || message.back() == ' ')) message.pop_back();
    if (!message.empty() && message[0] >= 'A' && message[0] <= 'Z')
        message[0] = static_cast<char>(message[0] - 'A' + 'a');
    const int at = error.GetPos();
    if (at < 0) return message;
    return fmt::format("{}: {}", place_in(text, static_cast<std::size_t>(at) + 1), message);
}

}  // namespace

// A parser is bound to the variables that it evaluates, so each thread has its own.
struct Expression::Shared {
    struct Bound {
        mu::Parser parser;
        std::vector<double> values;
    };

    std::string text;    // as written
    std::string parsed;  // as given to muParser
    std::vector<std::string> names;
    std::map<std::string, double> constants;
    Tables tables;
    std::vector<std::size_t> used;
    tbb::enumerable_thread_specific<std::unique_ptr<Bound>> bound;

    std::unique_ptr<Bound> bind() const {
        auto made = std::make_unique<Bound>();
        made->parser = bare_parser();
        made->values.assign(names.size(), 0.0);
        for (const auto& [name, value] : constants) made->parser.DefineConst(name, value);
        for (std::size_t k = 0; k < names.size(); ++k)
            if (!names[k].empty()) made->parser.DefineVar(names[k], &made->values[k]);
        for (const auto& [name, table] : tables) {
            // muParser passes the pointer back unchanged; look_up only reads the table.
            void* data = const_cast<Table*>(table.get());
            if (table->second.empty())
                made->parser.DefineFunUserData(name, look_up, data, false);
            else
                made->parser.DefineFunUserData(name, look_up_in_two, data, false);
        }
        made->parser.SetExpr(parsed);
        return made;
    }
    Bound& local() {
        std::unique_ptr<Bound>& mine = bound.local();
        if (!mine) mine = bind();
        return *mine;
    }
};

Expression::Expression(const std::string& text, std::vector<std::string> variables,
                       std::map<std::string, double> constants, Tables tables)
    : shared_(std::make_shared<Shared>()) {
    shared_->text = text;
    shared_->names = std::move(variables);
    shared_->constants = std::move(constants);
    shared_->tables = std::move(tables);
    std::vector<std::string> functions = expression_functions();
    for (const auto& [name, table] : shared_->tables) functions.push_back(name);
    shared_->parsed = with_brackets_close(text, functions);
    refuse_assignment(text);
    std::vector<std::string> known;
    for (const std::string& name : shared_->names)
        if (!name.empty()) known.push_back(name);
    for (const auto& [name, value] : shared_->constants) known.push_back(name);
    try {
        const mu::Parser& parser = shared_->local().parser;
        parser.Eval();
        if (parser.GetNumResults() > 1)
            throw ExpressionError("a comma separates several expressions, but only one is allowed");
        for (const auto& [name, address] : parser.GetUsedVar()) {
            const auto at = std::find(shared_->names.begin(), shared_->names.end(), name);
            if (at != shared_->names.end())
                shared_->used.push_back(static_cast<std::size_t>(at - shared_->names.begin()));
        }
    } catch (const mu::ParserError& error) {
        throw ExpressionError(reason(error, text, known, functions));
    }
    std::sort(shared_->used.begin(), shared_->used.end());
}

double Expression::operator()(std::span<const double> values) const {
    Shared::Bound& mine = shared_->local();
    for (const std::size_t k : shared_->used) mine.values[k] = values[k];
    try {
        return mine.parser.Eval();
    } catch (const mu::ParserError&) {  // the function has no value there
        return std::numeric_limits<double>::quiet_NaN();
    }
}

const std::string& Expression::text() const {
    return shared_->text;
}

const std::vector<std::size_t>& Expression::used() const {
    return shared_->used;
}

const std::vector<std::string>& expression_functions() {
    static const std::vector<std::string> names = [] {
        const mu::Parser parser;
        std::vector<std::string> list;
        for (const auto& [name, callback] : parser.GetFunDef()) list.push_back(name);
        return list;
    }();
    return names;
}

bool names_variable(std::string_view text, std::string_view variable) {
    return any_name(text, [&](std::size_t begin, std::size_t end) {
        if (text.substr(begin, end - begin) != variable) return false;
        while (end < text.size() && is_blank(text[end])) ++end;
        return end == text.size() || text[end] != '(';
    });
}

std::set<std::string> names_in(std::string_view text) {
    std::set<std::string> names;
    any_name(text, [&](std::size_t begin, std::size_t end) {
        names.emplace(text.substr(begin, end - begin));
        return false;
    });
    return names;
}

bool is_identifier(std::string_view name) {
    constexpr std::size_t kLongest = 64;
    return !name.empty() && name.size() <= kLongest && begins_name(name[0]) &&
           std::all_of(name.begin(), name.end(), in_name);
}

}  // namespace sidewall::app
