#include "app/recipe/decks.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "app/common/files.hpp"
#include "app/models/model.hpp"
#include "app/recipe/reader.hpp"
#include "app/recipe/steps.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

const fs::path& shipped() {
    static const fs::path folder = shipped_folder("configs/chemistry");
    return folder;
}

std::vector<Key> unit_keys(Units& units) {
    return {{"length_unit", &units.length, "", "", one_of(length_units())},
            {"time_unit", &units.time, "", "", one_of(time_units())}};
}

// The built-in material that a word means, or the word itself.
std::string meant(std::string_view word) {
    const auto id = meant_material(default_materials(), word);
    return id ? default_materials()[static_cast<std::size_t>(*id)].name : std::string(word);
}

Deck read_deck(const fs::path& file) {
    Deck deck{.name = file.stem().string(), .file = file};
    deck.tables = parse_toml(surface::read_whole_file(file), file.string());
    std::vector<Key> keys{{"title", &deck.title, "", "what it is for", required()},
                          {"holds", &deck.holds, "", ""},
                          {"sources", &deck.sources, "", ""}};
    append_keys(keys, unit_keys(deck.units));
    std::vector<std::string> notes;
    const Reading reading{default_materials(), notes};
    read_keys(deck.tables, "chemistry", "a chemistry", keys, reading, {"range", "expected", "step"});
    const toml::table* step = deck.tables["step"].as_table();
    if (step == nullptr) fail_missing(deck.tables, "step", "missing: [step] holds the model and its keys");
    if (const toml::node* nested = step->get("chemistry"))
        fail(*nested, "step.chemistry", "a chemistry names no other");
    const toml::node* range = deck.tables.get("range");
    if (range != nullptr && !range->is_table()) fail(*range, "range", "must be a table: KEY = [from, to]");
    for (const auto& [name, ends] : range != nullptr ? *range->as_table() : toml::table()) {
        std::vector<double> pair;
        read_key(*range->as_table(), "range", {std::string(name.str()), &pair, "", "", sized(2)}, reading);
        if (!(pair.at(0) <= pair.at(1))) fail(ends, fmt::format("range.{}", name.str()), "must rise");
    }
    read_key(*step, "step", {"model", &deck.model, "", "", one_of(model_names())}, reading);
    if (deck.model.empty())
        fail_missing(*step, "step.model", "missing: name a model that `sidewall models` lists");
    return deck;
}

fs::path file_of_deck(const toml::node& node, const std::string& path, const std::string& recipe) {
    const auto* text = node.as_string();
    if (text == nullptr) fail(node, path, "must be a string, in quotes");
    const bool own = text->get().ends_with(".toml");
    const bool plain =
        std::ranges::all_of(text->get(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
    if (!own && shipped().empty())
        fail(node, path,
             "the program's own chemistries are not found beside it: name a file that ends with .toml");
    fs::path file = own ? fs::absolute(fs::path(recipe).parent_path() / text->get()).lexically_normal()
                        : shipped() / (text->get() + ".toml");
    std::error_code failure;
    if ((own || plain) && fs::is_regular_file(file, failure)) return file;
    if (own) fail(node, path, "no such file: {}; the name is relative to the recipe", file.string());
    std::vector<std::string> names;
    for (const Deck& deck : shipped_decks()) names.push_back(deck.name);
    fail(node, path, "no chemistry has that name{}; a file of your own ends with .toml",
         deck_advice(text->get(), names));
}

// Moves to \p own what it lacks from \p deck, in tables by material too. A table with `default` replaces the
// deck's, as it replaces a key's defaults.
void fill(toml::table& own, toml::table& deck) {
    std::set<std::string> given;
    for (const auto& [key, node] : own) given.insert(meant(key.str()));
    for (auto&& [key, node] : deck) {
        toml::table *mine = own[key.str()].as_table(), *others = node.as_table();
        if (!given.contains(meant(key.str())))
            node.visit([&, &name = key](auto& value) { own.insert(name.str(), std::move(value)); });
        else if (mine != nullptr && others != nullptr && !mine->contains("default"))
            fill(*mine, *others);
    }
}

// A step that names a deck.
struct Use {
    std::string path;
    Deck deck;
};

void use_decks(toml::table& parent, const char* key, const std::string& path, const std::string& recipe,
               std::size_t depth, std::vector<Use>& uses) {
    toml::array* steps = depth < kMostKeyParts ? parent[key].as_array() : nullptr;
    for (std::size_t i = 0; steps != nullptr && i < steps->size(); ++i) {
        toml::table* step = (*steps)[i].as_table();
        if (step == nullptr) continue;
        const std::string here = fmt::format("{}[{}]", path, i);
        use_decks(*step, "steps", here + ".steps", recipe, depth + 1, uses);
        const toml::node* named = step->get("chemistry");
        if (named == nullptr || step->contains("steps"))
            continue;  // a loop has no such key; the reader refuses it
        const auto same = [&](const Use& use) { return use.path == here; };
        if (named->is_boolean() && std::ranges::any_of(uses, same)) continue;  // filled before
        Use use{here, read_deck(file_of_deck(*named, here + ".chemistry", recipe))};
        const toml::node* model = step->get("model");
        if (model != nullptr && model->value<std::string>() != use.deck.model)
            fail(*model, here + ".model", "chemistry {} is of model \"{}\": name that, or another chemistry",
                 use.deck.name, use.deck.model);
        fill(*step, *use.deck.tables["step"].as_table());
        // Marks the step as filled; a later override may set another deck.
        step->insert_or_assign("chemistry", true);
        std::erase_if(uses, same);
        uses.push_back(std::move(use));
    }
}

// Collects all strings of a recipe except names, as materials that they may mean.
void collect_materials(const toml::node& node, std::set<std::string>& found) {
    if (const auto* text = node.as_string()) found.insert(meant(text->get()));
    if (const auto* list = node.as_array())
        for (const toml::node& element : *list) collect_materials(element, found);
    if (const auto* table = node.as_table())
        for (const auto& [key, value] : *table)
            if (key.str() != "name") collect_materials(value, found);
}

// Fits the keys from a deck to the recipe: its units and materials, and notes.
class DeckConverter {
  public:
    DeckConverter(const toml::table& root, const Use& use, std::vector<std::string>& notes)
        : use_(use), notes_(notes), every_material_(root.contains("start")) {
        collect_materials(root, materials_);
        Units here;
        if (const toml::table* domain = root["domain"].as_table())
            for (const Key& key : unit_keys(here))
                read_key(*domain, "domain", key, {default_materials(), notes});
        length_ = size_in(here, use.deck.units.length).value();
        time_ = size_in(here, use.deck.units.time).value();
    }

    void fit(toml::table& table, const std::vector<Key>& keys, const std::string& inner = {}) {
        for (const Key& key : keys) {
            toml::node* node = table.get(key.name);
            if (node == nullptr) continue;
            if (const auto* tables = std::get_if<TableList>(&key.target)) {
                toml::array* list = node->as_array();
                tables->resize(1);
                for (std::size_t i = 0; list != nullptr && i < list->size(); ++i)
                    if (toml::table* element = (*list)[i].as_table())
                        fit(*element, tables->keys(0), fmt::format("{}{}[{}].", inner, key.name, i));
                continue;
            }
            const auto* numbers = std::get_if<ByMaterial*>(&key.target);
            const bool text = std::holds_alternative<Expressions*>(key.target);
            if (toml::table* values = node->as_table();
                values != nullptr && (numbers != nullptr || (text && key.rule.material))) {
                // For a key without a default the program itself refuses missing numbers.
                if (numbers == nullptr || (*numbers)->fallback) note_unknown(*values, inner + key.name);
                const std::vector<std::string> idle = drop_idle(*values);
                for (const std::string& name : idle)
                    idle_.insert(fmt::format("{}{}.{}", inner, key.name, name));
                if (values->empty() && key.rule.required)
                    fail_missing(
                        table, fmt::format("{}.{}{}", use_.path, inner, key.name),
                        fmt::format("chemistry {} has numbers for {}, none of which is on this wafer",
                                    use_.deck.name, fmt::join(idle, ", ")));
                if (values->empty()) {
                    table.erase(key.name);
                    continue;
                }
            }
            if (auto* file = node->as_string(); file != nullptr && from_deck(*node) && names_file(key))
                file->get() = (use_.deck.file.parent_path() / file->get()).lexically_normal().string();
            factors_[inner + key.name] = factor(key.unit);
            scale(*node, inner + key.name, factor(key.unit), text);
        }
    }

    void note_range(const toml::table& step) {
        const auto* ranges = use_.deck.tables["range"].as_table();
        if (ranges == nullptr) return;
        for (const auto& [name, range] : *ranges) {
            const std::string key(name.str());
            std::vector<double> ends;
            read_key(*ranges, "range", {key, &ends, "", "", sized(2)}, {default_materials(), notes_});
            const std::size_t slash = key.find('/');
            const std::string above = key.substr(0, slash);
            if (idle_.contains(above)) continue;
            double value = number(step, above), scale = factor_of(above);
            if (slash != std::string::npos) {
                const std::string below = key.substr(slash + 1);
                value /= number(step, below);
                scale /= factor_of(below);
            }
            constexpr double kRounding = 1e-9;
            const double low = scale * ends[0], high = scale * ends[1];
            if (value >= low - kRounding * std::abs(low) && value <= high + kRounding * std::abs(high))
                continue;
            const std::string where = fmt::format("{:g} to {:g}, where the sources of chemistry {} hold", low,
                                                  high, use_.deck.name);
            notes_.push_back(
                std::isnan(value)
                    ? fmt::format("{}.{} gives no number to compare with {}", use_.path, key, where)
                    : fmt::format("{}.{} = {:.4g} lies outside {}", use_.path, key, value, where));
        }
    }

  private:
    bool from_deck(const toml::node& node) const {
        return node.source().path && *node.source().path == use_.deck.file.string();
    }

    // Factor that converts a key's number from the deck's units to the recipe's.
    double factor(const std::string& unit) const {
        const double power = unit.starts_with("length^2") ? 2.0 : unit.starts_with("length") ? 1.0 : 0.0;
        return std::pow(length_, power) * (unit == "time"            ? time_
                                           : unit.ends_with("/time") ? 1.0 / time_
                                                                     : 1.0);
    }

    void scale(toml::node& node, const std::string& key, double factor, bool expression) {
        if (factor == 1.0) return;
        if (toml::table* table = node.as_table())
            for (auto&& [name, value] : *table) scale(value, key, factor, expression);
        if (toml::array* list = node.as_array())
            for (toml::node& element : *list) scale(element, key, factor, expression);
        if (!from_deck(node)) return;
        if (auto* number = node.as_floating_point()) number->get() *= factor;
        if (auto* text = node.as_string(); text != nullptr && expression)
            text->get() = fmt::format("{}*({})", toml_text(factor), text->get());
        if (const auto* whole = node.as_integer(); whole != nullptr && whole->get() != 0)
            fail(node, key,
                 "has a unit: write it with a decimal point, so that a recipe of other units can use it");
    }

    // Removes the deck's numbers for materials that the wafer never has, and returns these materials.
    std::vector<std::string> drop_idle(toml::table& values) const {
        std::vector<std::string> idle;
        for (const auto& [name, value] : values)
            if (name.str() != "default" && from_deck(value) && !every_material_ &&
                !materials_.contains(meant(name.str())))
                idle.emplace_back(name.str());
        for (const std::string& name : idle) values.erase(name);
        return idle;
    }

    static double number(const toml::table& step, const std::string& key) {
        const toml::node* node = find_node(step, key);
        return node == nullptr ? NAN : node->value<double>().value_or(NAN);
    }

    // Factor of a key, or of the table by material that contains it.
    double factor_of(const std::string& key) const {
        auto found = factors_.find(key);
        if (found == factors_.end()) found = factors_.find(key.substr(0, key.rfind('.')));
        return found == factors_.end() ? 1.0 : found->second;
    }

    void note_unknown(const toml::table& values, const std::string& key) {
        std::set<std::string> known;
        bool deck = false;
        for (const auto& [name, value] : values) {
            known.insert(meant(name.str()));
            deck = deck || from_deck(value);
        }
        std::vector<std::string> unknown;
        for (const Material& material : default_materials())
            if (materials_.contains(material.name) && !known.contains(material.name) &&
                material.name != "Mask")
                unknown.push_back(material.name);
        if (deck && !unknown.empty() && !known.contains("default"))
            notes_.push_back(
                fmt::format("{}.{}: chemistry {} has no number for {}: give one, or the key's default holds",
                            use_.path, key, use_.deck.name, fmt::join(unknown, ", ")));
    }

    const Use& use_;
    std::vector<std::string>& notes_;
    std::set<std::string> materials_, idle_;  // idle_: keys of materials that the wafer never has
    bool every_material_;
    std::map<std::string, double> factors_;  // by key: conversion from the deck's units to the recipe's
    double length_ = 1.0, time_ = 1.0;
};

void fit_deck(toml::table& root, const Use& use, std::vector<std::string>& notes) {
    // find_node returns part of the caller's own, writable tables as constant.
    auto* step = const_cast<toml::node*>(find_node(root, use.path));
    if (step == nullptr || !step->is_table()) return;
    toml::table& table = *step->as_table();
    if (!table["chemistry"].is_boolean()) return;  // replaced by a later override
    table.insert_or_assign("chemistry", use.deck.name);
    Step keys;
    keys.model = table["model"].value<std::string>().value_or("");
    if (const ModelEntry* model = find_model(keys.model)) keys.parameters = model->defaults;
    notes.push_back(fmt::format("{}.chemistry {}: {}{} ({})", use.path, use.deck.name, use.deck.title,
                                use.deck.holds.empty() ? "" : "; holds for " + use.deck.holds,
                                use.deck.file.string()));
    DeckConverter fitting(root, use, notes);
    fitting.fit(table, keys_of(keys));
    fitting.note_range(table);
}

}  // namespace

std::vector<Deck> shipped_decks() {
    std::vector<Deck> decks;
    std::error_code failure;
    for (const auto& entry : fs::directory_iterator(shipped(), failure))
        if (entry.path().extension() == ".toml") decks.push_back(read_deck(entry.path()));
    std::ranges::sort(decks, {}, &Deck::name);
    return decks;
}

std::string deck_advice(const std::string& name, const std::vector<std::string>& names) {
    return fmt::format("{} There are {}", did_you_mean(": ", name, names, "."), fmt::join(names, ", "));
}

toml::table recipe_tables(std::string_view text, const std::string& file,
                          const std::vector<std::string>& overrides, std::vector<std::string>& notes) {
    toml::table root = parse_toml(text, file);
    std::vector<Use> uses;
    // Overrides change what decks give, so those that choose decks come first. One that sets a whole step may
    // choose another deck.
    for (const bool choosing : {true, false}) {
        for (const std::string& setting : overrides)
            if (setting.substr(0, end_of_key(setting)).ends_with(".chemistry") == choosing)
                apply_override(root, setting);
        use_decks(root, "step", "step", file, 0, uses);
    }
    for (const Use& use : uses) fit_deck(root, use, notes);
    return root;
}

}  // namespace sidewall::app
