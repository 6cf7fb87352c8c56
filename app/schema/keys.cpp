#include "app/schema/keys.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <limits>
#include <numeric>

namespace sidewall::app {
namespace {

template <class... Ts>
struct Overloaded : Ts... {
    using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

template <class Range, class Text>
std::string list_text(const Range& range, Text&& text) {
    std::vector<std::string> items;
    items.reserve(std::size(range));
    for (const auto& item : range) items.push_back(text(item));
    return fmt::format("[{}]", fmt::join(items, ", "));
}

std::string number_list(std::span<const double> numbers) {
    return list_text(numbers, [](double x) { return toml_text(x); });
}

// Material names may hold characters that a bare TOML key may not.
std::string key_text(const std::string& key) {
    const bool bare = std::all_of(key.begin(), key.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
               c == '-';
    });
    return bare && !key.empty() ? key : toml_text(key);
}

std::string table_text(const ByMaterial& value) {
    if (value.named.empty()) return toml_text(value.fallback.value_or(0.0));
    std::vector<std::string> entries;
    for (const auto& [name, number] : value.named)
        entries.push_back(fmt::format("{} = {}", key_text(name), toml_text(number)));
    if (value.fallback) entries.push_back(fmt::format("default = {}", toml_text(*value.fallback)));
    return fmt::format("{{ {} }}", fmt::join(entries, ", "));
}

// A number as the recipe wrote it needs no quotes.
std::string expression_text(const std::string& text) {
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    const bool whole = error == std::errc() && end == text.data() + text.size();
    return whole && toml_text(number) == text ? text : toml_text(text);
}

std::string expressions_text(const Expressions& value, bool by_material) {
    if (by_material && value.named.size() == 1 && value.named.begin()->first == "default")
        return expression_text(value.named.begin()->second);
    std::vector<std::string> entries;
    for (const auto& [name, text] : value.named)
        entries.push_back(fmt::format("{} = {}", key_text(name), expression_text(text)));
    return fmt::format("{{ {} }}", fmt::join(entries, ", "));
}

std::string choice_text(const Choice& choice) {
    const std::span<const std::uint8_t> values(choice.values, choice.count);
    const auto word = [&](std::uint8_t value) { return toml_text(choice.words[value]); };
    return choice.count == 1 ? word(values[0]) : list_text(values, word);
}

std::string tables_text(const TableList& tables) {
    std::string text = "[\n";
    for (std::size_t i = 0; i < tables.size(); ++i) {
        std::vector<std::string> entries;
        for (const Key& key : tables.keys(i))
            if (const auto value = toml_text(key))
                entries.push_back(fmt::format("{} = {}", key.name, *value));
        text += fmt::format("    {{ {} }},\n", fmt::join(entries, ", "));
    }
    return text + "]";
}

std::string words_text(const std::vector<std::string>& words) {
    return fmt::format("{}", fmt::join(words, " | "));
}

std::string type_text(const Key& key) {
    std::string string_type = key.rule.material          ? "material"
                              : key.rule.choices.empty() ? "string"
                                                         : words_text(key.rule.choices);
    return std::visit(
        Overloaded{[](const bool*) -> std::string { return "boolean"; },
                   [](const std::int64_t*) -> std::string { return "whole number"; },
                   [](const double*) -> std::string { return "number"; },
                   [&](const std::optional<double>*) {
                       const std::string type = key.rule.whole ? "whole number" : "number";
                       return key.rule.word.empty() ? type : fmt::format("{} | \"{}\"", type, key.rule.word);
                   },
                   [&](const std::string*) { return string_type; },
                   [&](std::span<double> numbers) {
                       const std::size_t least = key.rule.size;
                       return least > 0 ? fmt::format("{} or {} numbers", least, numbers.size())
                                        : fmt::format("{} numbers", numbers.size());
                   },
                   [&](const std::vector<double>*) {
                       return key.rule.size > 0 ? fmt::format("{} numbers", key.rule.size)
                                                : "list of numbers";
                   },
                   [&](const std::vector<std::string>*) {
                       return key.rule.or_one ? fmt::format("{0}, or list of {0}", string_type)
                                              : "list of " + string_type;
                   },
                   [](const ByMaterial*) -> std::string { return "number, or table by material"; },
                   [&](const Expressions*) -> std::string {
                       return key.rule.material ? "expression, or table by material" : "table of expressions";
                   },
                   [](const TableList&) -> std::string { return "list of tables"; },
                   [](const Choice& choice) {
                       return choice.count == 1
                                  ? words_text(choice.words)
                                  : fmt::format("one or {} of {}", choice.count, words_text(choice.words));
                   }},
        key.target);
}

// What the value may be where it is a single word.
std::vector<std::string> words_of(const Key& key) {
    if (std::holds_alternative<bool*>(key.target)) return {"true", "false"};
    if (const auto* choice = std::get_if<Choice>(&key.target)) return choice->words;
    if (std::holds_alternative<std::string*>(key.target) || key.rule.or_one)
        return key.rule.material ? material_names(default_materials()) : key.rule.choices;
    if (key.rule.word.empty()) return {};
    return {key.rule.word};
}

}  // namespace

Rule within(double min, double max) {
    return {.min = min, .max = max};
}

Rule positive_to(double max) {
    return {.min = 0.0, .max = max, .above_min = true};
}

Rule one_of(std::vector<std::string> choices) {
    return {.choices = std::move(choices)};
}

Rule sized(std::size_t numbers) {
    return {.size = numbers};
}

Rule or_word(std::string word, Rule rule) {
    rule.word = std::move(word);
    return rule;
}

Rule required(Rule rule) {
    rule.required = true;
    return rule;
}

void append_keys(std::vector<Key>& keys, std::vector<Key> more) {
    std::move(more.begin(), more.end(), std::back_inserter(keys));
}

std::vector<KeyDoc> document(const std::vector<Key>& keys) {
    std::vector<KeyDoc> rows;
    for (const Key& key : keys) {
        const auto* tables = std::get_if<TableList>(&key.target);
        const std::string fallback = key.rule.required || tables ? "" : toml_text(key).value_or("");
        std::string doc = key.doc;
        if (const std::string range = range_text(key.rule); !range.empty()) doc += "; " + range;
        rows.push_back({key.name, type_text(key), key.unit, key.rule.required ? "required" : fallback, doc,
                        words_of(key)});
        if (tables == nullptr) continue;
        const std::size_t size = tables->size();
        tables->resize(size + 1);  // for the defaults of a table
        for (KeyDoc row : document(tables->keys(size))) {
            row.name = key.name + "[]." + row.name;
            rows.push_back(std::move(row));
        }
        tables->resize(size);
    }
    return rows;
}

std::string type_line(const KeyDoc& key) {
    std::string line = key.type;
    if (!key.unit.empty()) line += ", " + key.unit;
    if (!key.fallback.empty()) line += (key.fallback == "required" ? ", " : ", default ") + key.fallback;
    return line;
}

std::string range_text(const Rule& rule) {
    const bool low = rule.min > -kHuge, high = rule.max != kHuge;
    if (low && high) return fmt::format("in {}{:g}, {:g}]", rule.above_min ? "(" : "[", rule.min, rule.max);
    if (low) return fmt::format("{} {:g}", rule.above_min ? "greater than" : "at least", rule.min);
    if (high) return fmt::format("at most {:g}", rule.max);
    return "";
}

std::string toml_text(double number) {
    std::string text = fmt::format("{}", number);
    if (text.find_first_of(".en") == std::string::npos) text += ".0";  // e: exponent; n: inf and nan
    return text;
}

std::string toml_text(const std::string& text) {
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            quoted += fmt::format("\\{}", c);
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        else
            quoted += c;
    }
    return quoted + "\"";
}

std::optional<std::string> toml_text(const Key& key) {
    using Text = std::optional<std::string>;
    return std::visit(
        Overloaded{
            [](const bool* value) -> Text { return *value ? "true" : "false"; },
            [](const std::int64_t* value) -> Text { return fmt::format("{}", *value); },
            [](const double* value) -> Text { return toml_text(*value); },
            [&](const std::optional<double>* value) -> Text {
                if (*value) return toml_text(**value);
                return key.rule.word.empty() ? Text() : toml_text(key.rule.word);
            },
            [](const std::string* value) -> Text { return value->empty() ? Text() : toml_text(*value); },
            [&](std::span<double> value) -> Text {
                const bool fewer = key.rule.size > 0 && value.back() == 0.0;
                return number_list(value.first(fewer ? key.rule.size : value.size()));
            },
            [&](const std::vector<double>* value) -> Text {
                return value->empty() && key.rule.size > 0 ? Text() : number_list(*value);
            },
            [](const std::vector<std::string>* value) -> Text {
                return list_text(*value, [](const std::string& text) { return toml_text(text); });
            },
            [](const ByMaterial* value) -> Text { return table_text(*value); },
            [&](const Expressions* value) -> Text {
                return value->named.empty() ? Text() : expressions_text(*value, key.rule.material);
            },
            [](const TableList& value) -> Text { return tables_text(value); },
            [](const Choice& value) -> Text { return choice_text(value); }},
        key.target);
}

std::string did_you_mean(std::string_view before, std::string_view name,
                         std::span<const std::string> candidates, std::string_view otherwise) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    const std::string* best = nullptr;
    std::size_t best_distance = std::numeric_limits<std::size_t>::max();
    for (const std::string& candidate : candidates) {
        const std::size_t close = (std::max(name.size(), candidate.size()) + 2) / 3;
        // At least as many letters differ as the lengths do; a name of a megabyte is not compared letter by
        // letter.
        if (std::max(name.size(), candidate.size()) - std::min(name.size(), candidate.size()) > close)
            continue;
        // Levenshtein distance, one row at a time.
        std::vector<std::size_t> row(candidate.size() + 1);
        std::iota(row.begin(), row.end(), std::size_t{0});
        for (std::size_t i = 0; i < name.size(); ++i) {
            std::size_t diagonal = row[0];
            row[0] = i + 1;
            for (std::size_t j = 0; j < candidate.size(); ++j) {
                const std::size_t replaced = diagonal + (lower(name[i]) == lower(candidate[j]) ? 0 : 1);
                diagonal = row[j + 1];
                row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
            }
        }
        if (row.back() > close || row.back() >= best_distance) continue;
        best_distance = row.back();
        best = &candidate;
    }
    return best == nullptr ? std::string(otherwise) : fmt::format("{}did you mean {}?", before, *best);
}

}  // namespace sidewall::app
