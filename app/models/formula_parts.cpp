#include "app/models/formula_parts.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

// Sorts the steady coverages so that each follows those it names. Circular ones, and those that name these,
// go to `coupled`.
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

// Intervals of a yield's tables. 60 degrees, where some laws have a kink, is one of the angles.
constexpr int kAngles = 3072, kEnergies = 1024;
constexpr double kReach = 8.0;  // energies are tabulated up to so many standard deviations above the mean

// The law at kAngles + 1 angles of incidence from 0 to 90 degrees, equally spaced.
std::vector<double> tabulate(const Expression& angular, const std::string& key) {
    std::vector<double> table;
    for (int k = 0; k <= kAngles; ++k) {
        const double cosine = k < kAngles ? std::cos(0.5 * std::numbers::pi * k / kAngles) : 0.0;
        table.push_back(angular(std::array{cosine}));
        if (!std::isfinite(table.back())) raise_key(key, "has no finite value where cos is {:.6g}", cosine);
    }
    if (!(*std::max_element(table.begin(), table.end()) > 0.0))
        throw KeyError(key, "is nowhere above 0, so that there is no such yield");
    return table;
}

// Coefficients of cos, cos^2, ... if the law is such a polynomial, which the tracer evaluates exactly. Least
// squares at 33 cosines, with an increasing number of powers.
std::optional<std::vector<double>> polynomial(const Expression& angular, std::span<const double> table) {
    constexpr Eigen::Index kMostPowers = 8, kPoints = 33;
    for (Eigen::Index powers = 1; powers <= kMostPowers; ++powers) {
        Eigen::MatrixXd matrix(kPoints, powers);
        Eigen::VectorXd values(kPoints);
        for (Eigen::Index i = 0; i < kPoints; ++i) {
            const double cosine = static_cast<double>(i) / (kPoints - 1);
            for (Eigen::Index k = 0; k < powers; ++k) matrix(i, k) = std::pow(cosine, k + 1);
            values[i] = angular(std::array{cosine});
        }
        const Eigen::VectorXd a = matrix.colPivHouseholderQr().solve(values);
        constexpr double kRounding = 1e-13;
        const double size = values.cwiseAbs().maxCoeff();
        if (!(a.sum() > kRounding * size)) continue;
        const bool meets = (matrix * a - values).cwiseAbs().maxCoeff() <= kRounding * size;
        if (meets && *std::min_element(table.begin(), table.end()) >= -kRounding * size)
            return std::vector<double>(a.begin(), a.end());
    }
    return std::nullopt;
}

void set_angular(const Expression& angular, const std::string& key, flux::Yield& yield) {
    const std::vector<double> table = tabulate(angular, key);
    const auto [low, high] = std::minmax_element(table.begin(), table.end());
    if (*low == *high) {
        for (double& scale : yield.scale) scale *= *low;
    } else if (const auto powers = polynomial(angular, table)) {
        yield.angular = flux::Angular::polynomial;
        yield.coefficient = *powers;
        for (double& scale : yield.scale) scale *= std::accumulate(powers->begin(), powers->end(), 0.0);
    } else {
        yield.angular = flux::Angular::table;
        yield.coefficient = table;
    }
}

// Lowest energy with a positive yield, bisected to the last bit.
double threshold_of(const Expression& energy, double top, const std::string& key) {
    double low = 0.0, high = 0.0;
    for (int k = 0; k <= kEnergies; ++k) {
        const double part = static_cast<double>(k) / kEnergies;
        high = top * part * part;
        if (energy(std::array{high}) > 0.0) break;
        if (k == kEnergies)
            raise_key(key, "is not above 0 up to {:.4g} eV, the most that these ions have", top);
        low = high;
    }
    constexpr int kHalvings = 100;
    for (int k = 0; k < kHalvings && high > 0.0; ++k) {
        const double middle = 0.5 * (low + high);
        (energy(std::array{middle}) > 0.0 ? high : low) = middle;
    }
    return high;
}

void set_energy(const Expression& energy, double top, const std::string& key, flux::Yield& yield) {
    yield.energy_top = top;
    yield.threshold = threshold_of(energy, top, key);
    const double from = std::sqrt(yield.threshold), reach = std::sqrt(top) - from;
    if (!(reach > 0.0)) throw KeyError(key, "has its threshold above the energy of these ions");
    for (int k = 0; k <= kEnergies; ++k) {
        const double root = from + reach * k / kEnergies, value = energy(std::array{root * root});
        if (!std::isfinite(value)) raise_key(key, "has no finite value where E is {:.6g}", root * root);
        yield.energies.push_back(value);
    }
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
                throw KeyError(key, "begins with flux_, as fluxes do in the results: choose another name");
            names.coverages.push_back(name);
        }
    if (!names.coverages.empty() && names.fluxes.empty())
        throw KeyError(steady.empty() ? "coverage_rates" : "coverages",
                       "depend on fluxes; give the step a species");
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
                fmt::format("names no coverage of coverage_rates; give coverage_rates a law for {}", name));
        if (!formula.slow[k])
            throw KeyError(
                key, fmt::format("{0} is steady: `coverages` sets it by the local fluxes alone, so that it "
                                 "cannot diffuse; give coverage_rates its d/dt instead, e.g. a gain less a "
                                 "loss times {0}",
                                 name));
        formula.diffusion[k] = Law{key, read_expression(key, text, names.list(false), names)};
        const Expression& law = formula.diffusion[k]->expression;
        if (!law.used().empty()) continue;
        const double d = law(std::vector<double>(names.index(Extra::count), 0.0));
        if (!(d >= 0.0 && d <= kHuge)) raise_key(key, "is {:g}: must be in [0, {:g}]", d, kHuge);
    }
    if (laws.named.empty() && !on.empty())
        throw KeyError("diffuses_on", "has no effect, as no coverage diffuses; give diffusion, or drop it");
    formula.diffuses_on = on.empty() ? std::vector<std::uint8_t>(materials.size(), 1) : marked(on, materials);
}

std::vector<Key> yield_keys(YieldLaw& law) {
    return {{"name", &law.name, "", "name of the yield; expressions and outputs call its flux SPECIES_NAME",
             required()},
            {"angular", &law.angular, "",
             "dependence on the angle: expression of cos, the cosine of the angle of incidence; negative "
             "values count as 0"},
            {"energy", &law.energy, "",
             "dependence on the energy: expression of E, the ion's energy in eV; negative values count as 0"},
            {"scale", &law.scale, "", "constant factor of the yield", kNotNegative}};
}

flux::Yield read_yield(const YieldLaw& law, const std::string& path, const flux::Species& ion,
                       const Names& names) {
    flux::Yield yield;
    yield.name = law.name;
    yield.scale = by_material_id(law.scale, names.materials);
    set_angular(read_expression(path + "angular", law.angular, {"cos"}, names), path + "angular", yield);
    double top = ion.energy.mean + kReach * ion.energy.sigma;
    for (const flux::SourceBin& bin : ion.bins) top = std::max(top, bin.energy_to);
    set_energy(read_expression(path + "energy", law.energy, {"E"}, names), top, path + "energy", yield);
    return yield;
}

}  // namespace sidewall::app
