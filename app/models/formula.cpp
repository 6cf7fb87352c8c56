#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "app/models/formula_parts.hpp"
#include "app/models/particles.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Energy up to which all yields are 0: the smallest threshold, at most the mean energy; 0 without yields.
double least_energy(const flux::Species& ion) {
    double least = ion.yields.empty() ? 0.0 : ion.energy.mean;
    for (const flux::Yield& yield : ion.yields) least = std::min(least, yield.threshold);
    return least;
}

// Tally of every hit's cosine, from which `cos`, the mean over the arriving ions, is computed.
flux::Yield cosine_tally() {
    flux::Yield yield;
    yield.name = "cos";
    yield.angular = flux::Angular::cosine;
    yield.energies = {1.0, 1.0};
    yield.energy_top = 1.0;
    return yield;
}

struct SpeciesLaw {
    Particle particle;
    Cone cone;
    Expressions sticking{{{"default", "1.0"}}}, desorption{{{"default", "0.0"}}};
    std::vector<YieldLaw> yields;
    std::optional<double> stop_energy;
};

struct TableFile {
    std::string name, file;
};

struct FormulaKeys {
    Expressions rate{{{"default", "0.0"}}};
    std::vector<SpeciesLaw> species;
    Expressions parameters;
    std::vector<TableFile> tables;
    Expressions coverages, coverage_rates, diffusion;
    std::vector<std::string> diffuses_on;
    double coverage_tolerance = 1e-3;
    std::int64_t time_steps = 0;
    std::string time_spacing = "equal", deposit;
};

flux::Species read_species(const SpeciesLaw& law, const std::string& path, const Names& names, bool cosines) {
    flux::Species species = species_of(law.particle, path);
    if (!law.particle.is_ion()) {
        const auto refuse = [&](const std::string& key) {
            throw KeyError(path + key, "is for ions; set kind = \"ion\" or drop it");
        };
        if (!law.yields.empty()) refuse("yields");
        if (law.stop_energy) refuse("stop_energy");
        Cone given = law.cone, usual;
        const std::vector<Key> keys = reflection_keys(given), defaults = reflection_keys(usual);
        for (std::size_t k = 0; k < keys.size(); ++k)
            if (toml_text(keys[k]) != toml_text(defaults[k])) refuse(keys[k].name);
        return species;
    }
    set_reflection(law.cone, species);
    if (law.sticking != SpeciesLaw().sticking)
        throw KeyError(path + "sticking",
                       "is for neutrals; set reflect_from_deg and reflect_to_deg for ions");
    if (law.desorption != SpeciesLaw().desorption)
        throw KeyError(path + "desorption", "is for neutrals; drop it or the kind");
    for (std::size_t y = 0; y < law.yields.size(); ++y)
        species.yields.push_back(
            read_yield(law.yields[y], fmt::format("{}yields[{}].", path, y), species, names));
    species.stop_energy = law.stop_energy.value_or(least_energy(species));
    if (cosines) species.yields.push_back(cosine_tally());
    return species;
}

// Whether any expression of the step, but for parameters and yields, names one of the variables.
bool anywhere(const FormulaKeys& p, std::initializer_list<std::string_view> variables) {
    const auto in = [&](const Expressions& expressions) {
        for (const auto& [name, text] : expressions.named)
            for (const std::string_view variable : variables)
                if (names_variable(text, variable)) return true;
        return false;
    };
    for (const SpeciesLaw& law : p.species)
        if (in(law.sticking) || in(law.desorption)) return true;
    return in(p.rate) || in(p.coverages) || in(p.coverage_rates) || in(p.diffusion);
}

void read_parameters(const FormulaKeys& p, Names& names, std::set<std::string>& taken) {
    names.constants = {{"pi", std::numbers::pi}};
    for (const auto& [name, text] : p.parameters.named) check_name("parameters." + name, name, taken);
    constexpr std::size_t kMostInTurn = 200;
    std::set<std::string> open;  // being evaluated
    const auto read = [&](const auto& self, const std::string& name, const std::string& text) -> void {
        if (names.constants.contains(name)) return;
        const std::string key = "parameters." + name;
        if (!open.insert(name).second)
            throw KeyError(
                key, fmt::format("needs its own value: {} name each other in a circle; give one of them "
                                 "a number",
                                 fmt::join(open, ", ")));
        if (open.size() > kMostInTurn)
            raise_key(key, "depends on a chain of over {} parameters; give one of them a number",
                      kMostInTurn);
        for (const std::string& other : names_in(text))
            if (const auto found = p.parameters.named.find(other); found != p.parameters.named.end())
                self(self, other, found->second);
        const double value = read_expression(key, text, {}, names)({});
        if (!std::isfinite(value)) throw KeyError(key, "must be a finite number");
        names.constants[name] = value;
        open.erase(name);
    };
    for (const auto& [name, text] : p.parameters.named) read(read, name, text);
}

void read_tables(const FormulaKeys& p, const Units& units, Names& names, std::set<std::string>& taken) {
    for (std::size_t k = 0; k < p.tables.size(); ++k) {
        const auto& [name, file] = p.tables[k];
        check_name(fmt::format("tables[{}].name", k), name, taken);
        names.tables[name] = std::make_shared<const Table>(read_table(file, units));
    }
}

void read_all_species(const FormulaKeys& p, Model& model, Names& names, std::set<std::string>& taken) {
    const bool cosines = anywhere(p, {"cos"});
    for (std::size_t k = 0; k < p.species.size(); ++k) {
        const std::string path = species_path(k);
        const std::size_t first = names.fluxes.size();
        model.species.push_back(read_species(p.species[k], path, names, cosines));
        add_gas(p.species[k].particle.gas, path, model);
        model.species_keys.push_back(path);
        const std::vector<std::string> tallies = flux::tally_names(model.species.back());
        for (std::size_t t = 0; t < tallies.size(); ++t) {
            const std::string yields = fmt::format("{}yields[{}].name", path, t - 1);
            check_name(t == 0 ? path + "name" : yields, tallies[t], taken);
            names.fluxes.push_back(tallies[t]);
        }
        if (!p.species[k].particle.is_ion()) continue;
        names.ions.push_back(first);
        if (cosines) names.ion_cosines.push_back(names.fluxes.size() - 1);
    }
}

// Reads the laws of desorption, by species. Species with a law that is not 0 are marked as desorbing.
void read_desorption(const FormulaKeys& p, Model& model, Formula& formula) {
    formula.desorption.resize(p.species.size());
    for (std::size_t k = 0; k < p.species.size(); ++k) {
        const Expressions& text = p.species[k].desorption;
        if (text == SpeciesLaw().desorption) continue;
        const std::string key = species_path(k) + "desorption";
        formula.desorption[k] = laws_by_material(key, text, formula.names, false);
        bool none = true;
        for (const Law& law : formula.desorption[k]) {
            none = none && law.expression.used().empty();
            if (!law.expression.used().empty()) continue;
            const double flux = law.expression(std::vector<double>(formula.names.index(Extra::count), 0.0));
            if (!(flux >= 0.0 && flux <= kHuge))
                raise_key(law.key, "is {:g}: must be in [0, {:g}]", flux, kHuge);
            none = none && flux == 0.0;
        }
        model.species[k].desorbs = !none;
        if (none) formula.desorption[k].clear();
    }
}

// Reads the laws of sticking, and sets each species' sticking without coverages. Returns whether none varies
// on a material.
bool read_sticking(const FormulaKeys& p, Model& model, Formula& formula) {
    bool constant = true;
    for (std::size_t k = 0; k < p.species.size(); ++k) {
        formula.sticking.emplace_back();
        if (p.species[k].particle.is_ion()) continue;
        formula.sticking[k] =
            laws_by_material(species_path(k) + "sticking", p.species[k].sticking, formula.names, false);
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
                raise_key(law.key, "is {:g}: must be in [0, 1]", value);
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
            throw NumericsError(
                "{} = \"{}\" is positive on {}, where {}, and no film is named to grow: give the step deposit, or "
                "keep the rate at 0 or below",
                law.key, law.expression.text(), place_of(formula->names, point, values),
                named_values(law, formula->names, values));
        return speed;
    };
}

Model make_formula(const FormulaKeys& p, const Materials& materials, const Units& units) {
    Model model;
    const auto formula = std::make_shared<Formula>();
    std::set<std::string> taken;
    formula->names.materials = materials;
    read_tables(p, units, formula->names, taken);
    read_parameters(p, formula->names, taken);
    read_all_species(p, model, formula->names, taken);
    read_coverages(p.coverages, p.coverage_rates, *formula, taken);
    read_diffusion(p.diffusion, p.diffuses_on, materials, *formula);
    read_desorption(p, model, *formula);
    const bool fixed_sticking = read_sticking(p, model, *formula);
    formula->rate = laws_by_material("rate", p.rate, formula->names, true);
    model.deposit = film(p.deposit, materials, !p.deposit.empty());
    formula->grows = model.deposit.has_value();

    model.coverages.names = formula->names.coverages;
    model.coverages.tolerance = p.coverage_tolerance;
    model.coverages.transient = !formula->moving.empty();
    model.depends_on_position = anywhere(p, {"x", "y", "z", "depth"});
    constexpr int kTimeSteps = 100;
    const auto asked = static_cast<int>(p.time_steps);
    const bool moves = model.coverages.transient || anywhere(p, {"time"});
    model.min_time_steps = asked > 0 ? asked : moves ? kTimeSteps : 1;
    model.parabolic_time_steps = p.time_spacing == "parabolic";
    if (model.parabolic_time_steps && model.min_time_steps == 1)
        throw KeyError("time_spacing", "needs time steps to space; give time_steps");
    add_functions(formula, fixed_sticking, model);
    return model;
}

std::vector<Key> species_law_keys(SpeciesLaw& p) {
    std::vector<Key> keys = particle_keys(p.particle);
    keys[0].doc = "name of the species and of its flux in expressions and outputs";
    for (Key& key : reflection_keys(p.cone)) {
        key.doc = "ions: " + key.doc;
        keys.push_back(std::move(key));
    }
    keys.push_back(
        {"sticking", &p.sticking, "",
         "neutrals: probability that a hit sticks, a function of coverages, position and time; limited to "
         "[0, 1]",
         kMaterial});
    keys.push_back(
        {"desorption", &p.desorption, "",
         "neutrals: flux that desorbs by Lambert's law, in addition to arrivals that do not stick, a "
         "function of coverages, position and time; 1 is the flux on an open flat wafer. Negative values "
         "of an expression count as 0; a negative number is refused",
         kMaterial});
    keys.push_back({"yields", table_list(p.yields, yield_keys), "",
                    "ions: yield-weighted fluxes, in which each hit counts as angular * energy * scale"});
    keys.push_back({"stop_energy", &p.stop_energy, "eV",
                    "ions: energy below which a reflected ion is no longer followed; auto: the lowest "
                    "threshold of its yields",
                    or_word("auto", within(0.0, 1e6))});
    return keys;
}

std::vector<Key> table_file_keys(TableFile& table) {
    return {{"name", &table.name, "", "name by which expressions call the table, e.g. map in map(x, y)",
             required()},
            {"file", &table.file, "",
             "CSV file, relative to the recipe: columns of one or two arguments and of the value, a row "
             "for every point of a grid; linear between the points, constant beyond. Columns with a unit "
             "in the heading, such as \"x [nm]\", are converted to the recipe's units",
             required()}};
}

std::vector<Key> formula_keys(FormulaKeys& p) {
    return {
        {"rate", &p.rate, "length/time",
         "V: speed of the surface; positive grows, negative etches; 0 for materials a table leaves out",
         required(kMaterial)},
        {"species", table_list(p.species, species_law_keys), "",
         "the neutrals and ions whose fluxes are calculated"},
        {"parameters", &p.parameters, "", "constants by name: numbers, or expressions of other parameters"},
        {"tables", table_list(p.tables, table_file_keys), "",
         "functions of one or two arguments, tabulated in files"},
        {"coverages", &p.coverages, "",
         "coverages in steady state with the fluxes, by name; those that depend on each other are solved "
         "together"},
        {"coverage_rates", &p.coverage_rates, "1/time",
         "time derivatives of coverages that are not in steady state, by name; these start at 0, or at "
         "their values after the step before"},
        {"diffusion", &p.diffusion, "length^2/time",
         "surface diffusion coefficients D of coverages in coverage_rates, by name, functions of "
         "coverages, position and time; d theta/dt = rate + div(D grad theta)"},
        {"diffuses_on", &p.diffuses_on, "",
         "materials on which coverages diffuse; none diffuses from these to other materials; empty: all",
         kMaterial},
        coverage_tolerance_key(p.coverage_tolerance),
        {"time_steps", &p.time_steps, "",
         "smallest number of time steps in this step; 0: 100 if an expression names time or a coverage has "
         "a rate, else 1",
         within(0.0, 1e6)},
        {"time_spacing", &p.time_spacing, "",
         "lengths of the step's time steps: equal, or parabolic, where the k-th of n ends at (k/n)^2 of "
         "the step, for fronts that advance as the square root of time",
         one_of({"equal", "parabolic"})},
        deposit_key(p.deposit)};
}

constexpr const char* kExample =
    R"TEXT(Expressions know + - * / ^, comparisons, && and ||, a ? b : c, and the functions abs acos acosh asin asinh atan atan2 atanh
avg cos cosh exp ln log (natural) log10 log2 max min rint sign sin sinh sqrt sum tan tanh.
They may use
  tables                   as functions of one or two arguments: map(x, y), f(acos(cos))
  SPECIES                  the flux of a species, 1 on an open flat wafer
  SPECIES_YIELD            a yield's flux: the mean yield of a hit there times the species' flux
  coverages, parameters
  cos                      mean cosine of the angle of incidence of all arriving ions; 1 where none arrive
  x y z depth              position of the point; depth = -z; length
  time                     time since the step began
  density                  density of the material, 1e22 /cm^3
  pi
Sticking, desorption and diffusion may use no fluxes and no cos, which depend on them. Yields may use only cos or E, parameters and pi.

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
    ModelEntry entry =
        model_entry("formula", "rate law, coverages, sticking and yields as expressions in the recipe",
                    formula_keys, make_formula);
    entry.more = kExample;
    return entry;
}

}  // namespace sidewall::app
