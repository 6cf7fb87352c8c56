#include "app/recipe/figure_names.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "app/common/text.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Words of [metrology] measures with the figures of each (results/metrology.cpp); those of cd name depths.
const std::vector<std::pair<std::string, std::vector<std::string>>> kFigures = {
    {"depth", {"depth"}},
    {"cd", {}},
    {"sidewall_angle", {"sidewall_angle"}},
    {"bow", {"bow"}},
    {"undercut", {"undercut"}},
    {"aspect_ratio", {"aspect_ratio"}},
    {"voids", {"voids", "void_volume", "void_volume_whole", "void_top", "void_width"}},
    {"seam_depth", {"seam_depth"}},
    {"scallops", {"scallop_pitch", "scallop_depth"}},
    {"film", {"film_top", "film_side", "film_bottom", "step_coverage_side", "step_coverage_bottom"}},
};

// Form of a figure's name: its prefix, and whether a material and a place follow.
struct Form {
    const char* prefix;
    FigureKind kind;
    bool material, place;
};
constexpr Form kForms[] = {
    {"cd", FigureKind::opening, false, true},
    {"cd", FigureKind::width, true, true},
    {"thickness", FigureKind::thickness, true, true},
    {"wall", FigureKind::wall, true, true},
    {"recess", FigureKind::recess, true, false},
    {"ler", FigureKind::ler, false, true},
    {"lwr", FigureKind::lwr, false, true},
    {"volume", FigureKind::volume, true, false},
};

bool contains(const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
}

// Figures in every run's summary (process/record/summary.cpp); volumes only of materials once on the wafer.
std::vector<std::string> figures_of_all(const Recipe& recipe) {
    std::vector<std::string> names{"mean_rate"};
    for (const Material& material : recipe.materials)
        for (const char* kind : {"added_volume_", "removed_volume_"}) names.push_back(kind + material.name);
    return names;
}

// Reads a name by one form; no value if it has another.
std::optional<Figure> read_as(const Form& form, const std::string& name, const Materials& materials) {
    const std::string prefix = fmt::format("{}_", form.prefix);
    if (!name.starts_with(prefix)) return std::nullopt;
    Figure figure{name, form.kind, -1, 0.0, -1, {}};
    std::string rest = "_" + name.substr(prefix.size());
    if (form.place) {
        const std::size_t at = rest.rfind("_at_");
        if (at == std::string::npos) return std::nullopt;
        const auto number = finite_number(rest.substr(at + 4));
        // Only the spelling that the summary prints is accepted, so that a place has one name.
        if (!number || rest.substr(at + 4) != fmt::format("{:g}", *number)) return std::nullopt;
        figure.at = *number;
        rest = rest.substr(0, at);
    }
    if (!form.material) return rest.empty() ? std::optional(figure) : std::nullopt;
    const auto id = rest.size() > 1 ? meant_material(materials, rest.substr(1)) : std::nullopt;
    if (!id) return std::nullopt;
    figure.material = *id;
    return figure;
}

// Reads FIGURE_without_MATERIAL, where FIGURE is a measured one.
std::optional<Figure> read_without(const std::string& name, const Materials& materials) {
    constexpr std::string_view kWithout = "_without_";
    const std::size_t at = name.rfind(kWithout);
    if (at == std::string::npos) return std::nullopt;
    const std::string of = name.substr(0, at);
    const auto id = meant_material(materials, name.substr(at + kWithout.size()));
    const bool known = named_figure(of, materials) ||
                       std::any_of(kFigures.begin(), kFigures.end(),
                                   [&](const auto& word) { return contains(word.second, of); });
    if (!id || !known) return std::nullopt;
    return Figure{name, FigureKind::without, -1, 0.0, *id, of};
}

void add_once(auto& list, const auto& value) {
    if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

// Material id in "bare(MATERIAL)"; -1 if the name has another form.
int bare_material(const Recipe& recipe, const std::string& name) {
    const std::string_view view = name;
    if (!view.starts_with("bare(") || !view.ends_with(")")) return -1;
    const std::string material(trimmed(view.substr(5, view.size() - 6)));
    if (const auto id = meant_material(recipe.materials, material)) return *id;
    raise_key("stop", "{}: there is no material {}{}", name, material,
              did_you_mean(": ", material, material_names(recipe.materials), "; name one of the wafer's"));
}

// End of a message on an unknown figure: `; did you mean NAME?`, or where to find the names.
std::string nearest_figure(const Recipe& recipe, const std::string& name) {
    std::vector<std::string> known = measure_names();
    for (const auto& [word, figures] : kFigures) known.insert(known.end(), figures.begin(), figures.end());
    const auto always = figures_of_all(recipe);
    known.insert(known.end(), always.begin(), always.end());
    // Names with a place get the place asked for, or 0.5; those with a material get each material.
    const std::size_t at = name.rfind("_at_");
    const auto number = at == std::string::npos ? std::nullopt : finite_number(name.substr(at + 4));
    const std::string place = fmt::format("_at_{:g}", number.value_or(0.5));
    for (const Form& form : kForms) {
        const std::string end = form.place ? place : "";
        if (!form.material) known.push_back(form.prefix + end);
        for (std::size_t m = 0; form.material && m < recipe.materials.size(); ++m)
            known.push_back(fmt::format("{}_{}{}", form.prefix, recipe.materials[m].name, end));
    }
    std::erase(known, name);  // the refused name may be of a known form
    return did_you_mean(": ", name, known, "; see sidewall models metrology");
}

}  // namespace

const std::vector<std::string>& measure_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> words;
        words.reserve(std::size(kFigures));
        for (const auto& [word, figures] : kFigures) words.push_back(word);
        return words;
    }();
    return names;
}

std::optional<Figure> named_figure(const std::string& name, const Materials& materials) {
    for (const Form& form : kForms)
        if (auto figure = read_as(form, name, materials)) return figure;
    return read_without(name, materials);
}

std::optional<std::string> word_of(const Recipe& recipe, const std::string& figure) {
    for (const auto& [word, figures] : kFigures)
        if (contains(figures, figure)) return word;
    if (const auto named = named_figure(figure, recipe.materials))
        return named->kind == FigureKind::opening ? "cd" : figure;
    if (contains(figures_of_all(recipe), figure)) return "";
    return std::nullopt;  // a word that stands for several figures is no figure
}

bool is_roughness(const std::string& figure) {
    return figure.find("ler_at_") != std::string::npos || figure.find("lwr_at_") != std::string::npos;
}

void require_measure(const Recipe& recipe, const std::string& name, const std::string& key) {
    if (is_roughness(name) && is_flat(recipe.domain))
        raise_key(key,
                  "{}: a profile in x and z is the same along its lines: give domain.extent two numbers, "
                  "and a strip domain.strip = \"space\"",
                  name);
    const auto figure = named_figure(name, recipe.materials);
    if (figure && figure->kind == FigureKind::without && named_figure(figure->of, recipe.materials))
        require_measure(recipe, figure->of, key);
    if (figure && figure->kind == FigureKind::thickness) {
        const int axis = surface::parse_plane(recipe.metrology.cut).normal.x() != 0.0 ? 1 : 0;
        const double extent = recipe.domain.extent[static_cast<std::size_t>(axis)],
                     low = is_axial(recipe.domain) ? 0.0 : -0.5 * extent, high = low + extent;
        if (!(figure->at < high && (figure->at > low || figure->at == 0.0)))
            raise_key(key, "{}: lies outside the domain, from {:g} to {:g}", name, low, high);
    }
    const auto word = word_of(recipe, name);
    if (!figure && word && *word != name)
        throw KeyError(key, word->empty() ? fmt::format("{}: the summary of every run has it", name)
                                          : fmt::format("{}: is measured by \"{}\"", name, *word));
    if (!figure && !contains(measure_names(), name))
        raise_key(key, "{}: must be one of {}, or a figure such as cd_SiO2_at_0.5{}", name,
                  fmt::join(measure_names(), ", "), nearest_figure(recipe, name));
}

std::optional<StopRule> bare_rule(const Recipe& recipe, const Step& step) {
    if (!step.stop_material.empty())
        return StopRule{fmt::format("bare({})", step.stop_material), true, kBareShare,
                        *material_id(recipe.materials, step.stop_material)};
    if (step.stop.empty()) return std::nullopt;
    const StopRule rule = stop_rule(recipe, step.stop);
    return rule.bare < 0 ? std::nullopt : std::optional(rule);
}

StopRule stop_rule(const Recipe& recipe, const std::string& text) {
    const std::size_t sign = text.find_last_of("<>");
    if (sign == std::string::npos)
        throw KeyError("stop", "must be a measure, > or <, and a number, such as \"depth > 2.0\"");
    const bool equal = sign + 1 < text.size() && text[sign + 1] == '=';
    const std::string_view view = text;
    const std::string name(trimmed(view.substr(0, sign))),
        after(trimmed(view.substr(sign + 1 + (equal ? 1 : 0))));
    const auto value = finite_number(after);
    if (!value)
        raise_key("stop", "\"{}\" is no number: write e.g. \"{} {} 2.0\"", after,
                  name.empty() ? "depth" : name, text[sign]);
    if (const int bare = bare_material(recipe, name); bare >= 0) {
        if (!(*value > 0.0 && *value < 1.0))
            raise_key("stop",
                      "{} is a share of the floor: write a number between 0 and 1, "
                      "such as \"{} > 0.9\"",
                      name, name);
        return {name, text[sign] == '>', *value, bare};
    }
    const auto word = word_of(recipe, name);
    if (!word && contains(measure_names(), name))
        raise_key(
            "stop", "{} stands for several figures{}", name,
            name == "cd" ? ": name a depth, e.g. cd_at_0.5" : ": name one, see sidewall models metrology");
    if (!word || word->empty())
        raise_key("stop", "{} is no figure that a step can end at{}", name,
                  word ? ": it is found when the run has ended" : nearest_figure(recipe, name));
    if (named_figure(name, recipe.materials)) require_measure(recipe, name, "stop");
    return {name, text[sign] == '>', *value};
}

void want_measure(Recipe& recipe, const std::string& name, const std::string& option) {
    const auto wanted = contains(measure_names(), name) ? std::optional(name) : word_of(recipe, name);
    if (!wanted)
        throw RecipeError("{} {}: no run measures that{}", option, name, nearest_figure(recipe, name));
    if (!wanted->empty()) add_once(recipe.metrology.measures, *wanted);
    if (const auto figure = named_figure(name, recipe.materials)) {
        if (figure->kind == FigureKind::opening) add_once(recipe.metrology.cd_depths, figure->at);
        try {
            require_measure(recipe, name, option);
        } catch (const KeyError& error) {
            throw RecipeError(error.what());
        }
    }
    if (*wanted == "cd" && recipe.metrology.cd_depths.empty())
        throw RecipeError("{} {}: is measured at depths: name one, e.g. cd_at_0.5", option, name);
}

void want_figure(Recipe& recipe, const std::string& name, const std::string& option,
                 const std::string& text) {
    want_measure(recipe, name, option);
    if (word_of(recipe, name)) return;
    throw RecipeError("{} {}: {} stands for several figures: name one, e.g. {}", option, text, name,
                      name == "film" ? "film_side"
                      : name == "cd" ? "cd_at_0.5"
                                     : "scallop_depth");
}

}  // namespace sidewall::app
