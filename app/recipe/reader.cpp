#include "app/recipe/reader.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

std::string shortened(std::string_view text, std::size_t most = 200) {
    return text.size() > most ? std::string(text.substr(0, most - 3)) + "..." : std::string(text);
}

std::string value_text(const toml::node& node) {
    if (node.is_table()) return "{...}";
    if (const auto* number = node.as_floating_point()) return toml_text(number->get());
    if (const auto* string = node.as_string()) return shortened(toml_text(string->get()));
    if (const auto* array = node.as_array()) {
        if (array->size() > 20) return "[...]";
        std::string list;
        for (const toml::node& element : *array) list += (list.empty() ? "" : ", ") + value_text(element);
        return shortened(fmt::format("[{}]", list), 60);
    }
    std::ostringstream text;
    node.visit([&](const auto& value) { text << value; });
    std::string line = text.str();
    std::replace(line.begin(), line.end(), '\n', ' ');
    return shortened(line, 60);
}

double read_number(const toml::node& node, const std::string& path, const Rule& rule,
                   std::string_view or_word = {}) {
    if (!node.is_number()) fail(node, path, "must be a number{}", or_word);
    const double value =
        node.is_integer() ? static_cast<double>(node.as_integer()->get()) : node.as_floating_point()->get();
    if (!std::isfinite(value)) fail(node, path, "must be a finite number");
    const bool low = value < rule.min || (rule.above_min && value == rule.min);
    if (!low && value <= rule.max) return value;
    const std::string range = range_text(rule);
    if (range.empty() || (value > rule.max && rule.max == kHuge))
        fail(node, path, "must be in {}{:g}, {:g}]; check the unit", rule.above_min ? "(" : "[",
             std::max(rule.min, -kHuge), kHuge);
    fail(node, path, "must be " + range);
}

// Whole numbers may be written as floating-point numbers, such as 1e6.
std::int64_t read_integer(const toml::node& node, const std::string& path, const Rule& rule) {
    const double value = read_number(node, path, rule);
    if (node.is_integer()) return node.as_integer()->get();
    if (value != std::round(value)) fail(node, path, "must be a whole number");
    return static_cast<std::int64_t>(value);
}

std::string read_word(const toml::node& node, const std::string& path,
                      const std::vector<std::string>& words) {
    const auto* text = node.as_string();
    if (text != nullptr && std::find(words.begin(), words.end(), text->get()) != words.end())
        return text->get();
    std::string rule = fmt::format("must be one of {}", fmt::join(words, ", "));
    if (text != nullptr) rule += did_you_mean("; ", text->get(), words);
    fail(node, path, rule);
}

// The built-in or defined material that a recipe's word means; adds a note if its name differs.
std::string known_material(const toml::node& node, const std::string& path, const std::string& name,
                           const Reading& reading) {
    const Materials& materials = reading.materials;
    if (const auto id = meant_material(materials, name)) {
        const std::string& meant = materials[static_cast<std::size_t>(*id)].name;
        const std::string note = fmt::format(
            "{0} is taken as the built-in {1}; for another material give it a [[material]] with name = "
            "\"{0}\"",
            name, meant);
        if (meant != name &&
            std::find(reading.notes.begin(), reading.notes.end(), note) == reading.notes.end())
            reading.notes.push_back(note);
        return meant;
    }
    fail(node, path, "unknown material{} A new one needs a [[material]] of that name",
         did_you_mean(": ", name, material_names(materials), "."));
}

std::string read_string(const toml::node& node, const std::string& path, const Rule& rule,
                        const Reading& reading) {
    if (!rule.choices.empty()) return read_word(node, path, rule.choices);
    if (!node.is_string()) fail(node, path, "must be a string, in quotes");
    std::string text = node.as_string()->get();
    if (text.empty()) fail(node, path, "must not be empty");
    if (surface::printable(text, true) != text)
        fail(node, path,
             "must hold no line break, tab or control character: it is shown and written to tables");
    return rule.material ? known_material(node, path, text, reading) : text;
}

const toml::array& read_array(const toml::node& node, const std::string& path, std::size_t size,
                              std::string_view of) {
    const toml::array* array = node.as_array();
    if (array == nullptr || (size > 0 && array->size() != size))
        fail(node, path,
             size > 0 ? fmt::format("must be a list of {} {}", size, of)
                      : fmt::format("must be a list of {}", of));
    return *array;
}

// Whether the value comes from the command line, where it replaces the recipe's under either name of the key.
bool is_override(const toml::node& node) {
    return node.source().path && node.source().path->starts_with("--set ");
}

struct Reader {
    const toml::node& node;
    const std::string& path;
    const Rule& rule;
    const Reading& reading;

    std::string at(std::size_t i) const { return fmt::format("{}[{}]", path, i); }

    void operator()(bool* target) const {
        if (!node.is_boolean()) fail(node, path, "must be true or false");
        *target = node.as_boolean()->get();
    }
    void operator()(std::int64_t* target) const { *target = read_integer(node, path, rule); }
    void operator()(double* target) const { *target = read_number(node, path, rule); }
    void operator()(std::optional<double>* target) const {
        if (!rule.word.empty() && node.is_string() && node.as_string()->get() == rule.word)
            target->reset();
        else
            *target =
                read_number(node, path, rule, rule.word.empty() ? "" : fmt::format(" or \"{}\"", rule.word));
    }
    void operator()(std::string* target) const { *target = read_string(node, path, rule, reading); }
    void operator()(std::span<double> target) const {
        // A rule with a size also accepts an array shorter by one; the missing last number is 0.
        const toml::array* given = node.as_array();
        const bool fewer = rule.size > 0 && given != nullptr && given->size() == rule.size;
        const std::string of = rule.size > 0 ? fmt::format("numbers, or of {}", rule.size) : "numbers";
        const toml::array& array = read_array(node, path, fewer ? rule.size : target.size(), of);
        std::fill(target.begin(), target.end(), 0.0);
        for (std::size_t i = 0; i < array.size(); ++i) target[i] = read_number(array[i], at(i), rule);
    }
    void operator()(std::vector<double>* target) const {
        const toml::array& array = read_array(node, path, rule.size, "numbers");
        target->clear();
        for (std::size_t i = 0; i < array.size(); ++i) target->push_back(read_number(array[i], at(i), rule));
        refuse_empty(array);
    }
    void operator()(std::vector<std::string>* target) const {
        if (node.is_string() && rule.or_one) {
            *target = {read_string(node, path, rule, reading)};
            return;
        }
        const toml::array& array = read_array(node, path, rule.size, "strings");
        target->clear();
        for (std::size_t i = 0; i < array.size(); ++i)
            target->push_back(read_string(array[i], at(i), rule, reading));
        refuse_empty(array);
    }
    void operator()(ByMaterial* target) const {
        const toml::table* table = node.as_table();
        // A table overrides materials of the key's default; a number, or a table with `default`, replaces it.
        if (table == nullptr || table->contains("default")) target->named.clear();
        if (table == nullptr) {
            target->fallback =
                read_number(node, path, rule, " or a table by material, e.g. { Si = 0.2, default = 0.1 }");
            return;
        }
        std::set<std::string> given;
        for (const auto& [key, value] : *table) {
            std::string name(key.str());
            const std::string name_path = path + "." + name;
            const double number = read_number(value, name_path, rule);
            if (name == "default") {
                target->fallback = number;
                continue;
            }
            // The key's default may name materials that not every recipe knows.
            if (!target->named.contains(name)) name = known_material(value, name_path, name, reading);
            refuse_twice(value, name_path, name, given);
            target->named[name] = number;
        }
        if (table->empty()) fail(node, path, "must not be empty: name a material or give a number");
    }
    void operator()(Expressions* target) const {
        const toml::table* table = node.as_table();
        const std::string example = rule.material
                                        ? "an expression in quotes, a number or a table of them by material"
                                        : "a table of expressions, e.g. { k = 0.3 }";
        if (table == nullptr) {
            if (!rule.material) fail(node, path, "must be " + example);
            target->named = {{"default", read_expression(node, path)}};
            return;
        }
        if (!rule.material || table->contains("default")) target->named.clear();
        std::set<std::string> given;
        for (const auto& [key, value] : *table) {
            std::string name(key.str());
            const std::string name_path = path + "." + name;
            if (rule.material && name != "default") name = known_material(value, name_path, name, reading);
            refuse_twice(value, name_path, name, given);
            target->named[name] = read_expression(value, name_path);
        }
        if (table->empty()) fail(node, path, "must not be empty: must be " + example);
    }
    void operator()(const TableList& target) const {
        const toml::array& array = read_array(node, path, 0, "tables");
        refuse_empty(array);
        target.resize(0);
        for (std::size_t i = 0; i < array.size(); ++i) {
            const toml::table* table = array[i].as_table();
            if (table == nullptr) fail(array[i], at(i), "must be a table, e.g. { name = \"ion\" }");
            target.resize(i + 1);
            read_keys(*table, at(i), "this table", target.keys(i), reading);
        }
    }
    // One word stands for all values; so does a list of one word.
    void operator()(const Choice& target) const {
        const auto index = [&](const std::string& word) {
            return static_cast<std::uint8_t>(std::find(target.words.begin(), target.words.end(), word) -
                                             target.words.begin());
        };
        if (target.count == 1 || node.is_string()) {
            std::fill_n(target.values, target.count, index(read_word(node, path, target.words)));
            return;
        }
        const toml::array* given = node.as_array();
        const bool one = given != nullptr && given->size() == 1;
        const toml::array& array = read_array(node, path, one ? 1 : target.count, "words");
        for (std::size_t i = 0; i < target.count; ++i)
            target.values[i] = index(read_word(array[one ? 0 : i], at(one ? 0 : i), target.words));
    }

    static std::string read_expression(const toml::node& node, const std::string& path) {
        if (node.is_number()) return toml_text(read_number(node, path, {}));
        if (!node.is_string()) fail(node, path, "must be an expression in quotes, or a number");
        return node.as_string()->get();
    }
    // Two words may name one material.
    static void refuse_twice(const toml::node& value, const std::string& path, const std::string& name,
                             std::set<std::string>& given) {
        if (!given.insert(name).second) fail(value, path, "is the second value for {}; drop one", name);
    }
    void refuse_empty(const toml::array& array) const {
        if (rule.required && array.empty()) fail(node, path, "must not be empty");
    }
};

// Position after the string or comment that begins at \p i; \p i if none begins there.
std::size_t past_quoted(std::string_view text, std::size_t i) {
    const char c = text[i];
    if (c == '#') return std::min(text.find('\n', i), text.size());
    if (c != '"' && c != '\'') return i;
    const bool several_lines = text.substr(i, 3) == std::string(3, c);
    const std::string end(several_lines ? 3 : 1, c);
    for (std::size_t k = i + end.size(); k < text.size(); ++k) {
        if (c == '"' && text[k] == '\\')
            ++k;
        else if (text.substr(k, end.size()) == end)
            return k + end.size();
        else if (!several_lines && text[k] == '\n')
            return k;  // invalid TOML: the parser reports it
    }
    return text.size();
}

}  // namespace

std::size_t line_of_deep_key(std::string_view text) {
    std::size_t line = 1, dots = 0;
    for (std::size_t i = 0; i < text.size();) {
        if (const std::size_t end = past_quoted(text, i); end > i) {
            line +=
                static_cast<std::size_t>(std::count(text.begin() + static_cast<std::ptrdiff_t>(i),
                                                    text.begin() + static_cast<std::ptrdiff_t>(end), '\n'));
            i = end;
            continue;
        }
        const char c = text[i++];
        if (c == '.' && ++dots >= kMostKeyParts) return line;
        if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) dots = 0;
        line += c == '\n';
    }
    return 0;
}

toml::table parse_toml(std::string_view text, const std::string& source) {
    if (const std::size_t line = line_of_deep_key(text); line > 0)
        throw RecipeError("{}:{}: a key of over {} parts joined by dots: no recipe has one", source, line,
                          kMostKeyParts);
    try {
        return toml::parse(text, std::string_view(source));
    } catch (const toml::parse_error& error) {
        throw RecipeError("{}:{}: not valid TOML at column {}: {}", source, error.source().begin.line,
                          error.source().begin.column, error.description());
    }
}

std::string place_of(const toml::node& node) {
    const toml::source_region& source = node.source();
    if (!source.path) return "recipe";
    if (is_override(node)) return *source.path;
    return fmt::format("{}:{}", *source.path, source.begin.line);
}

void fail(const toml::node& node, std::string_view path, std::string_view rule) {
    throw RecipeError("{}: {} = {}: {}", place_of(node), shortened(path), value_text(node), rule);
}

void fail_missing(const toml::node& table, std::string_view path, std::string_view rule) {
    throw RecipeError("{}: {}: {}", place_of(table), shortened(path), rule);
}

void read_key(const toml::table& table, const std::string& path, const Key& key, const Reading& reading) {
    std::string name = key.name;
    if (!key.former.empty() && table.contains(key.former)) {
        const std::string former_path = path + "." + key.former;
        const toml::node &former = *table.get(key.former), *node = table.get(name);
        if (node == nullptr || (is_override(former) && !is_override(*node)))
            name = key.former;
        else if (is_override(former) || !is_override(*node))
            fail(former, former_path, "is now called {}; drop one of the two", name);
        reading.notes.push_back(fmt::format("{} is now called {}", former_path, key.name));
    }
    const std::string key_path = path + "." + name;
    if (const toml::node* node = table.get(name))
        std::visit(Reader{*node, key_path, key.rule, reading}, key.target);
}

void read_keys(const toml::table& table, const std::string& path, std::string_view what,
               const std::vector<Key>& keys, const Reading& reading, const std::vector<std::string>& nested) {
    const auto path_to = [&](std::string_view key) { return fmt::format("{}.{}", path, key); };
    std::vector<std::string> known = nested;
    for (const Key& key : keys) known.push_back(key.name);
    const auto former = [&](std::string_view name) {
        return std::any_of(keys.begin(), keys.end(),
                           [&](const Key& key) { return !key.former.empty() && key.former == name; });
    };
    for (const auto& [name, node] : table)
        if (std::find(known.begin(), known.end(), name.str()) == known.end() && !former(name.str()))
            fail(node, path_to(name.str()), "unknown key of {}{} `sidewall models` lists all keys", what,
                 did_you_mean(": ", name.str(), known, ";"));
    for (const Key& key : keys) {
        if (key.rule.required && !table.contains(key.name) &&
            (key.former.empty() || !table.contains(key.former)))
            fail_missing(table, path_to(key.name),
                         fmt::format("missing: {} needs it ({}{}{})", what, key.doc,
                                     key.unit.empty() ? "" : "; ", key.unit));
        read_key(table, path, key, reading);
    }
}

std::vector<const toml::table*> tables_of(const toml::table& parent, std::string_view key,
                                          const std::string& path) {
    std::vector<const toml::table*> tables;
    const toml::node* node = parent.get(key);
    if (node == nullptr) return tables;
    std::string header;  // the path without its indices
    for (const PathPart& part : split_path(path)) header += (header.empty() ? "" : ".") + part.key;
    const std::string rule = fmt::format("must be one or more tables: write [[{}]]", header);
    const toml::array* array = node->as_array();
    if (array == nullptr || array->empty()) fail(*node, path, rule);
    for (const toml::node& element : *array) {
        if (!element.is_table()) fail(element, path, rule);
        tables.push_back(element.as_table());
    }
    return tables;
}

}  // namespace sidewall::app
