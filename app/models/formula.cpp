#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "app/models/formula_coverages.hpp"
#include "app/models/formula_yields.hpp"
#include "app/models/gas_keys.hpp"
#include "app/models/ions.hpp"
#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

// The energy up to which no yield is left.
double least_energy(const flux::Species& ion) {
    double least = ion.yields.empty() ? 0.0 : ion.energy.mean;
    for (const flux::Yield& yield : ion.yields) least = std::min(least, yield.threshold);
    return least;
}

// Every hit's cosine, so that `cos` is the mean over the ions that arrive.
flux::Yield cosine_tally() {
    flux::Yield yield;
    yield.name = "cos";
    yield.angular = flux::Angular::cosine;
    yield.energies = {1.0, 1.0};
    yield.energy_top = 1.0;
    return yield;
}

// How the ions of the plasma models are reflected: cone, inflection, energy_exponent.
std::vector<Key> reflection_keys() {
    const std::vector<Key> keys = ion_keys();
    return {keys.end() - 3, keys.end()};
}

flux::Species read_species(const Values& values, std::size_t k, const Names& names, bool cosines) {
    const std::string path = species_path(k);
    flux::Species species = particle(values, path);
    const auto& yields = values.get<std::vector<Values>>("yields");
    const auto stop = values.get<std::optional<double>>("stop_energy");
    if (!is_ion(values)) {
        if (!yields.empty()) throw KeyError(path + "yields", "is for ions; set kind = \"ion\" or drop it");
        if (stop) throw KeyError(path + "stop_energy", "is for ions; set kind = \"ion\" or drop it");
        for (const Key& key : reflection_keys())
            if (values.entries.at(key.name) != key.fallback)
                throw KeyError(path + key.name, "is for ions; set kind = \"ion\" or drop it");
        return species;
    }
    species.reflection.cone = kRadiansPerDegree * values.get<double>("cone");
    species.reflection.inflection = kRadiansPerDegree * values.get<double>("inflection");
    species.reflection.exponent = values.get<double>("energy_exponent");
    if (values.get<Expressions>("sticking") != Expressions{{{"default", "1.0"}}})
        throw KeyError(path + "sticking",
                       "is for neutrals; set reflect_from_deg and reflect_to_deg for ions");
    if (values.get<Expressions>("desorption") != Expressions{{{"default", "0.0"}}})
        throw KeyError(path + "desorption", "is for neutrals; drop it or the kind");
    for (std::size_t y = 0; y < yields.size(); ++y)
        species.yields.push_back(
            read_yield(yields[y], fmt::format("{}yields[{}].", path, y), species, names));
    species.stop_energy = stop.value_or(least_energy(species));
    if (cosines) species.yields.push_back(cosine_tally());
    return species;
}

// Whether an expression of the step names one of these.
bool anywhere(const Values& values, std::initializer_list<std::string_view> variables) {
    const auto in = [&](const Expressions& expressions) {
        for (const auto& [name, text] : expressions.named)
            for (const std::string_view variable : variables)
                if (names_variable(text, variable)) return true;
        return false;
    };
    for (const Values& species : values.get<std::vector<Values>>("species"))
        for (const char* key : {"sticking", "desorption"})
            if (in(species.get<Expressions>(key))) return true;
    return in(values.get<Expressions>("rate")) || in(values.get<Expressions>("coverages")) ||
           in(values.get<Expressions>("coverage_rates")) || in(values.get<Expressions>("diffusion"));
}

void read_parameters(const Values& values, Names& names, std::set<std::string>& taken) {
    names.constants = {{"pi", std::numbers::pi}};
    const Names numbers = names;
    for (const auto& [name, text] : values.get<Expressions>("parameters").named) {
        const std::string key = "parameters." + name;
        check_name(key, name, taken);
        const double value = read_expression(key, text, {}, numbers)({});
        if (!std::isfinite(value)) throw KeyError(key, "must be a finite number");
        names.constants[name] = value;
    }
}

void read_tables(const Values& values, Names& names, std::set<std::string>& taken) {
    const auto& list = values.get<std::vector<Values>>("tables");
    for (std::size_t k = 0; k < list.size(); ++k) {
        const auto& name = list[k].get<std::string>("name");
        check_name(fmt::format("tables[{}].name", k), name, taken);
        names.tables[name] = std::make_shared<const Table>(read_table(list[k].get<std::string>("file")));
    }
}

void read_all_species(const Values& values, Model& model, Names& names, std::set<std::string>& taken) {
    const auto& list = values.get<std::vector<Values>>("species");
    const bool cosines = anywhere(values, {"cos"});
    for (std::size_t k = 0; k < list.size(); ++k) {
        const std::size_t first = names.fluxes.size();
        model.species.push_back(read_species(list[k], k, names, cosines));
        add_gas(list[k], species_path(k), model);
        model.species_keys.push_back(species_path(k));
        const std::vector<std::string> tallies = flux::tally_names(model.species.back());
        for (std::size_t t = 0; t < tallies.size(); ++t) {
            const std::string yields = fmt::format("{}yields[{}].name", species_path(k), t - 1);
            check_name(t == 0 ? species_path(k) + "name" : yields, tallies[t], taken);
            names.fluxes.push_back(tallies[t]);
        }
        if (!is_ion(list[k])) continue;
        names.ions.push_back(first);
        if (cosines) names.ion_cosines.push_back(names.fluxes.size() - 1);
    }
}

// What leaves the surface, by species.
void read_desorption(const Values& values, Model& model, Formula& formula) {
    const auto& list = values.get<std::vector<Values>>("species");
    formula.desorption.resize(list.size());
    for (std::size_t k = 0; k < list.size(); ++k) {
        const auto& text = list[k].get<Expressions>("desorption");
        if (text == Expressions{{{"default", "0.0"}}}) continue;
        const std::string key = species_path(k) + "desorption";
        formula.desorption[k] = laws_by_material(key, text, formula.names, false);
        bool none = true;
        for (const Law& law : formula.desorption[k]) {
            none = none && law.expression.used().empty();
            if (!law.expression.used().empty()) continue;
            const double flux = law.expression(std::vector<double>(formula.names.index(Extra::count), 0.0));
            if (!(flux >= 0.0 && flux <= kHuge))
                throw KeyError(law.key, fmt::format("is {:g}: must be in [0, {:g}]", flux, kHuge));
            none = none && flux == 0.0;
        }
        model.species[k].desorbs = !none;
        if (none) formula.desorption[k].clear();
    }
}

// Sticking without coverages, for the species; and whether it is the same everywhere on a material and at all
// times.
bool read_sticking(const Values& values, Model& model, Formula& formula) {
    const auto& list = values.get<std::vector<Values>>("species");
    bool constant = true;
    for (std::size_t k = 0; k < list.size(); ++k) {
        formula.sticking.emplace_back();
        if (is_ion(list[k])) continue;
        formula.sticking[k] = laws_by_material(species_path(k) + "sticking",
                                               list[k].get<Expressions>("sticking"), formula.names, false);
        std::vector<double>& sticking = model.species[k].sticking;
        sticking.clear();
        for (std::size_t m = 0; m < formula.names.materials.size(); ++m) {
            const Law& law = formula.sticking[k][m];
            std::vector<double> bare(formula.names.index(Extra::count), 0.0);
            bare[formula.names.index(Extra::density)] = formula.names.materials[m].density;
            const auto& used = law.expression.used();
            const bool fixed = std::all_of(used.begin(), used.end(), [&](std::size_t i) {
                return i == formula.names.index(Extra::density);
            });
            const double value = law.expression(bare);
            if (fixed && !(value >= 0.0 && value <= 1.0))
                throw KeyError(law.key, fmt::format("is {:g}: must be in [0, 1]", value));
            constant = constant && fixed;
            sticking.push_back(std::isfinite(value) ? std::clamp(value, 0.0, 1.0) : 1.0);
        }
    }
    return constant;
}

void add_functions(const std::shared_ptr<const Formula>& formula, bool fixed_sticking, Model& model) {
    model.coverages.react = [formula](const SurfacePoint& point, double time, std::span<double> theta) {
        react(*formula, point, time, theta);
    };
    if (!fixed_sticking)
        model.sticking = [formula, own = model.species](std::size_t k, const SurfacePoint& point) {
            if (formula->sticking[k].empty()) return own[k].sticking[0];
            const Law& law = formula->sticking[k][static_cast<std::size_t>(point.material)];
            return std::clamp(evaluate(law, formula->names, point, formula->names.values(point)), 0.0, 1.0);
        };
    const auto& species = model.species;
    if (std::any_of(species.begin(), species.end(), [](const flux::Species& one) { return one.desorbs; }))
        model.desorption = [formula](std::size_t k, const SurfacePoint& point) {
            if (formula->desorption[k].empty()) return 0.0;
            const Law& law = formula->desorption[k][static_cast<std::size_t>(point.material)];
            return std::max(0.0, evaluate(law, formula->names, point, formula->names.values(point)));
        };
    for (std::size_t k = 0; k < formula->diffusion.size(); ++k)
        if (formula->diffusion[k]) model.coverages.diffusing.push_back(k);
    model.coverages.diffusivity = [formula](std::size_t k, const SurfacePoint& point) {
        return diffusivity(*formula, k, point);
    };
    model.coverages.rate = [formula](std::size_t k, const SurfacePoint& point) {
        return coverage_rate(*formula, k, point);
    };
    model.speed = [formula](const SurfacePoint& point) {
        const Law& law = formula->rate[static_cast<std::size_t>(point.material)];
        const std::span<const double> values = formula->names.values(point);
        const double speed = evaluate(law, formula->names, point, values);
        if (speed > 0.0 && !formula->grows)
            throw NumericsError(fmt::format(
                "{} = \"{}\" is positive on {}, where {}, and no film is named to grow: give the step deposit, or "
                "keep the rate at 0 or below",
                law.key, law.expression.text(), place_of(formula->names, point, values),
                named_values(law, formula->names, values)));
        return speed;
    };
}

Model make_formula(const Values& values, const Materials& materials) {
    Model model;
    const auto formula = std::make_shared<Formula>();
    std::set<std::string> taken;
    formula->names.materials = materials;
    read_tables(values, formula->names, taken);
    read_parameters(values, formula->names, taken);
    read_all_species(values, model, formula->names, taken);
    read_coverages(values, *formula, taken);
    read_diffusion(values, materials, *formula);
    read_desorption(values, model, *formula);
    const bool fixed_sticking = read_sticking(values, model, *formula);
    formula->rate = laws_by_material("rate", values.get<Expressions>("rate"), formula->names, true);
    model.deposit = film(values, materials, !values.get<std::string>("deposit").empty());
    formula->grows = model.deposit.has_value();

    model.coverages.names = formula->names.coverages;
    model.coverages.tolerance = values.get<double>("coverage_tolerance");
    model.coverages.transient = !formula->moving.empty();
    model.depends_on_position = anywhere(values, {"x", "y", "z", "depth"});
    constexpr int kTimeSteps = 100;
    const auto asked = static_cast<int>(values.get<std::int64_t>("time_steps"));
    const bool moves = model.coverages.transient || anywhere(values, {"time"});
    model.least_time_steps = asked > 0 ? asked : moves ? kTimeSteps : 1;
    model.growing_time_steps = values.get<std::string>("time_spacing") == "parabolic";
    if (model.growing_time_steps && model.least_time_steps == 1)
        throw KeyError("time_spacing", "needs time steps to space; give time_steps");
    add_functions(formula, fixed_sticking, model);
    return model;
}

std::vector<Key> species_keys() {
    std::vector<Key> keys = particle_keys();
    keys[0].doc = "of its flux in expressions and outputs";
    for (Key& key : reflection_keys()) {
        key.doc = "ions: " + key.doc;
        keys.push_back(std::move(key));
    }
    keys.push_back(
        {"sticking",
         Expressions{{{"default", "1.0"}}},
         "",
         "neutrals: probability that a hit sticks, of coverages, position and time; kept in [0, 1]",
         {.material = true}});
    keys.push_back(
        {"desorption",
         Expressions{{{"default", "0.0"}}},
         "",
         "neutrals: flux that leaves the surface by Lambert's law, beside what does not stick, of coverages, "
         "position and time: 1 is what arrives on an open flat wafer; 0 where an expression is negative, which a number may not be",
         {.material = true}});
    keys.push_back({"yields",
                    std::vector<Values>(),
                    "",
                    "ions: further fluxes, each hit counted as angular * energy * scale",
                    {.keys = yield_keys()}});
    keys.push_back({"stop_energy",
                    std::optional<double>(),
                    "eV",
                    "ions: with less a reflected one is dropped; auto: where the last yield ends",
                    {.min = 0.0, .max = 1e6, .word = "auto"}});
    return keys;
}

constexpr const char* kExample =
    R"TEXT(Expressions know + - * / ^, comparisons, && and ||, a ? b : c, and the functions abs acos acosh asin asinh atan atan2 atanh
avg cos cosh exp ln log (natural) log10 log2 max min rint sign sin sinh sqrt sum tan tanh, written with no space before (.
They may name
  tables                   as functions of one or two of these: map(x, y), f(acos(cos))
  every species            its flux, 1 on an open flat wafer
  SPECIES_YIELD            a yield's flux: the mean yield of a hit there times the species' flux
  coverages, parameters
  cos                      mean cosine of the incidence of all ions that arrive; 1 where none does
  x y z depth              of the point; depth = -z; length
  time                     since the step began
  density                  of the material, 1e22 /cm^3
  pi
but sticking, desorption and diffusion no fluxes or cos, which follow from them, and yields only cos or E, parameters and pi.

  [[step]]
  model = "formula"
  duration = 10.0
  species = [
      { name = "F", sticking = { Si = "0.2*(1 - theta)", default = 0.05 } },
      { name = "ion", kind = "ion", energy = 100.0, yields = [
          { name = "sputter", angular = "(1 + 9.3*(1 - cos^2))*cos", energy = "sqrt(E) - sqrt(20)", scale = 0.03 } ] },
  ]
  parameters = { k = 0.3 }
  coverages = { theta = "k*F/(k*F + 1)" }
  rate = { Si = "-0.1*F*(1 - theta) - 0.02*ion_sputter", default = 0 }
)TEXT";

}  // namespace

ModelEntry formula() {
    return {
        "formula",
        "rate law, coverages, sticking and yields as expressions in the recipe",
        {{"rate",
          Expressions{{{"default", "0.0"}}},
          "length/time",
          "V: positive grows, negative etches; 0 for materials a table leaves out",
          {.required = true, .material = true}},
         {"species", std::vector<Values>(), "", "what is traced", {.keys = species_keys()}},
         {"parameters", Expressions{}, "", "numbers by name"},
         {"tables",
          std::vector<Values>(),
          "",
          "functions of one or two numbers from files",
          {.keys =
               {{"name", std::string(), "", "by which expressions call it, e.g. map(x, y)", required()},
                {"file", std::string(), "",
                 "CSV beside the recipe: a line of names, then arguments and value, a row for every point "
                 "of a grid; linear between them, constant beyond",
                 required()}}}},
         {"coverages", Expressions{}, "",
          "in steady state with the fluxes: by name; those that name each other are solved together"},
         {"coverage_rates", Expressions{}, "1/time",
          "of coverages that are slower: d/dt by name; they begin at 0, or as the step before left them"},
         {"diffusion", Expressions{}, "length^2/time",
          "of coverages that have a rate, along the surface: D by name, of coverages, position and time; d/dt = rate + div(D "
          "grad)"},
         {"diffuses_on",
          std::vector<std::string>(),
          "",
          "materials that coverages diffuse on, none from one to what is not named; empty: all",
          {.material = true}},
         {"coverage_tolerance",
          1e-3,
          "",
          "mean change of a coverage at which the first fluxes are settled",
          {.min = 1e-8, .max = 1.0}},
         {"time_steps",
          std::int64_t{0},
          "",
          "at least so many; 0: 100 where an expression names time or a coverage has a rate, else 1",
          {.min = 0.0, .max = 1e6}},
         {"time_spacing",
          std::string("equal"),
          "",
          "of those: equal, or parabolic, the k-th of n ending at (k/n)^2 of the step: for fronts that go as the square root of "
          "time",
          {.choices = {"equal", "parabolic"}}},
         deposit_key()},
        make_formula,
        nullptr,
        false,
        kExample};
}

}  // namespace sidewall::app
