#include "app/models/formula_coverages.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/models/ions.hpp"

namespace sidewall::app {
namespace {

// Steady coverages in an order in which each follows those it names; the rest depend on each other.
void order_coverages(Formula& formula) {
    const std::size_t first = formula.names.fluxes.size();
    std::vector<std::uint8_t> known(formula.steady.size(), 0);
    for (std::size_t k = 0; k < known.size(); ++k) known[k] = formula.steady[k] ? 0 : 1;
    for (bool found = true; found;) {
        found = false;
        for (std::size_t k = 0; k < known.size(); ++k) {
            if (known[k]) continue;
            const auto& used = formula.steady[k]->expression.used();
            const bool ready = std::all_of(used.begin(), used.end(), [&](std::size_t i) {
                return i < first || i >= first + known.size() || known[i - first];
            });
            if (!ready) continue;
            known[k] = 1;
            formula.ordered.push_back(k);
            found = true;
        }
    }
    for (std::size_t k = 0; k < known.size(); ++k)
        if (!known[k]) formula.coupled.push_back(k);
}

}  // namespace

void read_coverages(const Expressions& coverages, const Expressions& rates, Formula& formula,
                    std::set<std::string>& taken) {
    Names& names = formula.names;
    const auto &steady = coverages.named, &slow = rates.named;
    for (const auto* list : {&steady, &slow})
        for (const auto& [name, text] : *list) {
            const std::string key = (list == &steady ? "coverages." : "coverage_rates.") + name;
            check_name(key, name, taken);
            if (name.starts_with("flux_"))
                throw KeyError(key, "begins as fluxes do in the results: choose another name");
            names.coverages.push_back(name);
        }
    if (!names.coverages.empty() && names.fluxes.empty())
        throw KeyError(steady.empty() ? "coverage_rates" : "coverages",
                       "follow from fluxes; give the step a species");
    const auto law = [&](const std::string& key, const std::string& text) {
        return Law{key, read_expression(key, text, names.list(), names)};
    };
    for (std::size_t k = 0; k < names.coverages.size(); ++k) {
        const std::string& name = names.coverages[k];
        formula.steady.emplace_back();
        formula.slow.emplace_back();
        if (k < steady.size()) {
            formula.steady[k] = law("coverages." + name, steady.at(name));
        } else {
            formula.slow[k] = law("coverage_rates." + name, slow.at(name));
            formula.moving.push_back(k);
        }
    }
    order_coverages(formula);
}

void read_diffusion(const Expressions& laws, const std::vector<std::string>& on, const Materials& materials,
                    Formula& formula) {
    const Names& names = formula.names;
    formula.diffusion.resize(names.coverages.size());
    for (const auto& [name, text] : laws.named) {
        const std::string key = "diffusion." + name;
        const auto found = std::find(names.coverages.begin(), names.coverages.end(), name);
        const auto k = static_cast<std::size_t>(found - names.coverages.begin());
        if (found == names.coverages.end())
            throw KeyError(
                key,
                fmt::format("is of no coverage that takes time; give coverage_rates a law for {}", name));
        if (!formula.slow[k])
            throw KeyError(
                key, fmt::format(
                         "{0} is steady: `coverages` says what it is from the fluxes of each place alone, so "
                         "that nothing is left to diffuse; diffusion is of a coverage that takes time: give "
                         "coverage_rates its d/dt in place of that, e.g. a gain less a loss times {0}",
                         name));
        formula.diffusion[k] = Law{key, read_expression(key, text, names.list(false), names)};
        const Expression& law = formula.diffusion[k]->expression;
        if (!law.used().empty()) continue;
        const double d = law(std::vector<double>(names.index(Extra::count), 0.0));
        if (!(d >= 0.0 && d <= kHuge))
            throw KeyError(key, fmt::format("is {:g}: must be in [0, {:g}]", d, kHuge));
    }
    if (laws.named.empty() && !on.empty())
        throw KeyError("diffuses_on", "is where coverages diffuse, and none does; give diffusion or drop it");
    formula.diffuses_on = on.empty() ? std::vector<std::uint8_t>(materials.size(), 1) : marked(on, materials);
}

}  // namespace sidewall::app
