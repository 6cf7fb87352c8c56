#include "app/recipe/step_materials.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/models/geometric_steps.hpp"
#include "app/models/model.hpp"
#include "app/recipe/steps.hpp"

namespace sidewall::app {
namespace {

// Walks through the steps in order and tracks the materials that can be on the wafer.
class Walk {
  public:
    Walk(const Recipe& recipe, std::span<const int> on_wafer)
        : materials_(recipe.materials), present_(on_wafer.begin(), on_wafer.end()) {
        for (const Layer& layer : recipe.layers) {
            add(layer.material);
            for (const std::string& name : layer.materials) add(name);
        }
    }

    void through(const std::vector<Step>& steps, const std::string& path) {
        for (std::size_t i = 0; i < steps.size(); ++i) {
            const Step& step = steps[i];
            const std::string here = fmt::format("{}[{}]", path, i);
            if (!step.steps.empty()) {
                // The second round starts with what the first leaves; a third would add none.
                for (int round = 0; round < (step.repeat > 1 ? 2 : 1); ++round)
                    through(step.steps, here + ".steps");
            } else {
                meet(step, here);
            }
        }
    }

    std::vector<StepMaterials> found;

  private:
    void add(const std::string& name) {
        if (const auto id = material_id(materials_, name)) present_.insert(*id);
    }

    void meet(const Step& step, const std::string& path) {
        const auto named = [keys = model_keys(step)](const char* key) {
            const auto* name = target_of<std::string>(keys, key);
            return name == nullptr ? std::string() : *name;
        };
        if (step.model == "strip") {
            for (const std::string& name : geometric_step(step.parameters)->materials)
                if (const auto id = material_id(materials_, name)) present_.erase(*id);
            return;
        }
        add(named("deposit"));
        const ModelEntry* model = find_model(step.model);
        if (model == nullptr || !model->make) {
            add(named("material"));  // material that fills or coats
            return;
        }
        auto entry = std::find_if(found.begin(), found.end(),
                                  [&](const StepMaterials& other) { return other.step == &step; });
        if (entry == found.end()) entry = found.insert(found.end(), {path, &step, {}});
        std::set<int> all(entry->ids.begin(), entry->ids.end());
        all.insert(present_.begin(), present_.end());
        entry->ids.assign(all.begin(), all.end());
    }

    const Materials& materials_;
    std::set<int> present_;
};

struct Column {
    std::string key;
    const ByMaterial* value;
};

// The numbers or expressions of a key by material, as text.
struct TextColumn {
    std::string key;
    std::map<std::string, std::string, std::less<>> values;  // including "default"
};

std::vector<TextColumn> texts(const std::vector<Key>& keys) {
    std::vector<TextColumn> list;
    each_key(keys, [&](const Key& key, const std::string& path) {
        TextColumn column{path, {}};
        if (const auto* numbers = std::get_if<ByMaterial*>(&key.target)) {
            for (const auto& [name, number] : (*numbers)->named) column.values[name] = toml_text(number);
            if ((*numbers)->fallback) column.values["default"] = toml_text(*(*numbers)->fallback);
        }
        if (const auto* texts = std::get_if<Expressions*>(&key.target); texts != nullptr && key.rule.material)
            column.values.insert((*texts)->named.begin(), (*texts)->named.end());
        if (!column.values.empty()) list.push_back(std::move(column));
    });
    return list;
}

std::vector<Column> columns(const Step& step) {
    std::vector<Column> list;
    each_key(model_keys(step), [&](const Key& key, const std::string& path) {
        if (const auto* by_material = std::get_if<ByMaterial*>(&key.target))
            list.push_back({path, *by_material});
    });
    return list;
}

std::string value_text(const ByMaterial& value, const std::string& material) {
    const auto found = value.named.find(material);
    if (found != value.named.end()) return fmt::format("{:g}", found->second);
    return value.fallback ? fmt::format("{:g}*", *value.fallback) : "-";
}

// One line a row; columns as wide as their longest text.
std::string aligned(const std::vector<std::vector<std::string>>& rows, const std::string& prefix) {
    std::vector<std::size_t> width(rows.front().size(), 0);
    for (const auto& row : rows)
        for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], row[k].size());
    std::string text;
    for (const auto& row : rows) {
        std::string line = prefix;
        for (std::size_t k = 0; k < row.size(); ++k) line += fmt::format("  {:<{}}", row[k], width[k]);
        text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    }
    return text;
}

std::string table_of(const StepMaterials& here, const Recipe& recipe) {
    const std::vector<Column> list = columns(*here.step);
    std::vector<std::string> head{"material"};
    for (const Column& column : list) head.push_back(column.key);
    head.push_back("density");
    std::vector<std::vector<std::string>> rows{head};
    for (const int id : here.ids) {
        const Material& material = recipe.materials[static_cast<std::size_t>(id)];
        std::vector<std::string> row{material.name};
        for (const Column& column : list) row.push_back(value_text(*column.value, material.name));
        row.push_back(fmt::format("{:g}", material.density));
        rows.push_back(std::move(row));
    }
    return fmt::format("#\n# {} {}\n{}", here.path, here.step->model, aligned(rows, "#"));
}

}  // namespace

std::vector<StepMaterials> materials_by_step(const Recipe& recipe, std::span<const int> on_wafer) {
    Walk walk(recipe, on_wafer);
    walk.through(recipe.steps, "step");
    return std::move(walk.found);
}

void require_values(const StepMaterials& here, const Materials& materials) {
    const auto* film = target_of<std::string>(model_keys(*here.step), "deposit");
    std::string first, rule;
    for (const auto& [key, value] : columns(*here.step)) {
        std::vector<std::string> missing, known;
        for (const int id : here.ids) {
            const std::string& name = materials[static_cast<std::size_t>(id)].name;
            if (!value->fallback && !value->named.contains(name) && (film == nullptr || *film != name))
                missing.push_back(name);
        }
        if (missing.empty()) continue;
        for (const auto& [other, number] : value->named)
            known.push_back(fmt::format("{} {:g}", other, number));
        const std::string last = missing.size() > 1 ? " and " + missing.back() : "";
        rule += fmt::format(
            "{}has no value for {}{}, which {} on the wafer, and no published one is known: give {} = {{ {} = ... }}; "
            "there is {}",
            first.empty() ? "" : fmt::format("; {}, too, ", key),
            fmt::join(missing.begin(), last.empty() ? missing.end() : missing.end() - 1, ", "), last,
            last.empty() ? "is" : "are", key, fmt::join(missing, " = ..., "), fmt::join(known, ", "));
        if (first.empty()) first = key;
    }
    if (!first.empty()) throw KeyError(first, rule);
}

std::vector<IdleValues> idle_values(const StepMaterials& here, const Materials& materials) {
    std::set<std::string> met{"default"};
    for (const int id : here.ids) met.insert(materials[static_cast<std::size_t>(id)].name);
    const ModelEntry& model = *find_model(here.step->model);
    std::any defaults = model.defaults;
    const std::vector<TextColumn> given = texts(model_keys(*here.step)), usual = texts(model.keys(defaults));
    std::vector<IdleValues> idle;
    for (const TextColumn& column : given) {
        const auto of_model = std::ranges::find(usual, column.key, &TextColumn::key);
        IdleValues here_idle{column.key, {}};
        for (const auto& [name, text] : column.values) {
            const auto same = [&, &text = text](const TextColumn& other, const std::string& key) {
                const auto found = other.values.find(key);
                return found != other.values.end() && found->second == text;
            };
            if (met.contains(name) || same(column, "default") ||
                (of_model != usual.end() && same(*of_model, name)))
                continue;
            here_idle.materials.push_back(name);
        }
        if (!here_idle.materials.empty()) idle.push_back(std::move(here_idle));
    }
    return idle;
}

std::string values_by_material(const Recipe& recipe) {
    std::string text;
    for (const StepMaterials& here : materials_by_step(recipe))
        if (!columns(*here.step).empty()) text += table_of(here, recipe);
    if (text.empty()) return text;
    return fmt::format(
               "#\n# Values in force by material; density in 1e22 /cm^3, other units as above; * not named: the "
               "key's default.\n") +
           text;
}

std::string built_in_materials() {
    const Materials& materials = default_materials();
    std::vector<std::vector<std::string>> rows{{"name", "colour", "density"}};
    for (const Material& material : materials)
        rows.push_back({material.name, material.colour, fmt::format("{:g}", material.density)});
    std::set<std::string> others;
    for (const ModelEntry& model : models()) {
        std::any defaults = model.defaults;
        for (const Key& key : model.keys(defaults)) {
            const auto* yields = std::get_if<ByMaterial*>(&key.target);
            if (yields == nullptr || !key.name.ends_with("_yield")) continue;
            rows[0].push_back(fmt::format("{} {}", model.name, key.name));
            for (std::size_t m = 0; m < materials.size(); ++m)
                rows[m + 1].push_back(value_text(**yields, materials[m].name));
            for (const auto& [name, number] : (*yields)->named)
                if (!material_id(materials, name)) others.insert(name);
        }
    }
    std::map<std::string, std::string> words;  // by material
    for (const auto& [word, name] : material_words())
        words[name] += fmt::format("{}{}", words[name].empty() ? "" : " ", word);
    rows[0].push_back("also called");
    for (std::size_t m = 0; m < materials.size(); ++m) rows[m + 1].push_back(words[materials[m].name]);
    return fmt::format(
        "Built-in materials: density in 1e22 atoms, or formula units of a compound, per cm^3; yields as in the "
        "models'\nkeys, - where none is published and a recipe must give one. {} has yields, too; a [[material]] "
        "of that name\ngives its density.\n{}",
        fmt::join(others, ", "), aligned(rows, ""));
}

}  // namespace sidewall::app
