#include "app/schema/keys.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <boost/algorithm/string/predicate.hpp>
#include <iterator>
#include <limits>
#include <numeric>

#include "surface/files/file.hpp"

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

std::string table_text(const ByMaterial& value) {
    if (value.named.empty()) return toml_text(value.fallback.value_or(0.0));
    std::vector<std::string> entries;
    for (const auto& [name, number] : value.named)
        entries.push_back(fmt::format("{} = {}", key_text(name), toml_text(number)));
    if (value.fallback) entries.push_back(fmt::format("default = {}", toml_text(*value.fallback)));
    return fmt::format("{{ {} }}", fmt::join(entries, ", "));
}

// An expression that is a number, as toml_text writes it, needs no quotes.
std::string expression_text(const std::string& text) {
    double number = 0.0;
    return surface::read_number(text, number) && toml_text(number) == text ? text : toml_text(text);
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

// The words that a key's value may be, if it can be a single word.
std::vector<std::string> words_of(const Key& key) {
    if (std::holds_alternative<bool*>(key.target)) return {"true", "false"};
    if (const auto* choice = std::get_if<Choice>(&key.target)) return choice->words;
    if (std::holds_alternative<std::string*>(key.target) || key.rule.or_one)
        return key.rule.material ? material_names(default_materials()) : key.rule.choices;
    if (key.rule.word.empty()) return {};
    return {key.rule.word};
}

}  // namespace

bool key_character(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

std::string key_text(const std::string& key) {
    return !key.empty() && std::ranges::all_of(key, key_character) ? key : toml_text(key);
}

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

bool names_file(const Key& key) {
    return key.name == "file" || key.name.ends_with("_file");
}

void each_key(const std::vector<Key>& keys,
              const std::function<void(const Key&, const std::string& path)>& visit,
              const std::string& before) {
    for (const Key& key : keys) {
        visit(key, before + key.name);
        const auto* tables = std::get_if<TableList>(&key.target);
        for (std::size_t i = 0; tables != nullptr && i < tables->size(); ++i)
            each_key(tables->keys(i), visit, fmt::format("{}{}[{}].", before, key.name, i));
    }
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
        tables->resize(size + 1);  // a new table holds the defaults
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
        // The distance is at least the difference in length: no name of a megabyte is compared by letters.
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

const Materials& default_materials() {
    // Densities follow from mass density and formula weight. The mask is ideal: at its density it hardly
    // sputters. Ids are written to files: append only.
    static const Materials table = {
        {"Si", "#8fa3b8", 5.02},    {"SiO2", "#e0b060", 2.2},   {"Si3N4", "#6fb58a", 1.36},
        {"PolySi", "#7d7fb5", 5.0}, {"SiGe", "#b58fb8", 4.8},   {"Ge", "#9a86a8", 4.42},
        {"Mask", "#c8584c", 500.0}, {"Resist", "#d98ca0", 0.6}, {"Polymer", "#78c0c8", 2.2},
        {"W", "#70757c", 6.31},     {"TiN", "#a8862c", 5.26},   {"Al2O3", "#d8d4e4", 2.33},
        {"HfO2", "#88a850", 2.77},  {"Cu", "#c8743c", 8.49},    {"Carbon", "#3c4048", 10.0},
    };
    return table;
}

std::optional<int> material_id(const Materials& materials, std::string_view name) {
    const auto found = std::ranges::find(materials, name, &Material::name);
    if (found == materials.end()) return std::nullopt;
    return static_cast<int>(found - materials.begin());
}

const std::vector<MaterialWord>& material_words() {
    static const std::vector<MaterialWord> words = {
        {"silicon", "Si"},         {"c-si", "Si"},
        {"oxide", "SiO2"},         {"quartz", "SiO2"},
        {"sin", "Si3N4"},          {"nitride", "Si3N4"},
        {"poly", "PolySi"},        {"poly-si", "PolySi"},
        {"polysilicon", "PolySi"}, {"germanium", "Ge"},
        {"photoresist", "Resist"}, {"pr", "Resist"},
        {"tungsten", "W"},         {"alumina", "Al2O3"},
        {"hafnia", "HfO2"},        {"copper", "Cu"},
        {"a-c", "Carbon"},         {"carbon", "Carbon"},
        {"resist", "Resist"},      {"polymer", "Polymer"},
        {"mask", "Mask"},          {"fluorocarbon", "Polymer"},
    };
    return words;
}

std::optional<int> meant_material(const Materials& materials, std::string_view name) {
    if (const auto id = material_id(materials, name)) return id;
    for (const auto& [word, built_in] : material_words())
        if (boost::iequals(word, name)) return material_id(materials, built_in);
    return std::nullopt;
}

std::vector<std::string> material_names(const Materials& materials) {
    std::vector<std::string> names;
    for (const Material& material : materials) names.push_back(material.name);
    return names;
}

}  // namespace sidewall::app
