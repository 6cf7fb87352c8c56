#include <algorithm>
#include <cmath>

#include "app/models/chemistry.hpp"
#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

// The neutrals, in the order of the species; each has one coverage.
enum Neutral : std::size_t { kF, kO, kC };

constexpr double kGermaniumBoost = 0.4675;  // k_sigma(x) = k_sigma exp(0.4675 x)

struct Cf4O2 {
    double etchant_flux = 1800.0, oxygen_flux = 100.0, polymer_flux = 100.0, ion_flux = 12.0;
    std::vector<std::string> etched{"Si", "PolySi", "SiGe", "Ge"};
    ByMaterial germanium{0.0, {{"SiGe", 0.3}, {"Ge", 1.0}}};
    ByMaterial etchant_sticking{0.7}, etchant_on_oxygen_sticking{0.3};
    ByMaterial oxygen_sticking{1.0}, oxygen_on_polymer_sticking{0.3};
    ByMaterial polymer_sticking{1.0}, polymer_on_oxygen_sticking{0.3};
    bool coverage_beta = true;
    double coverage_tolerance = 1e-3, k_sigma = 300.0, beta_sigma = 0.04;
    ByMaterial sputter_yield = sputter_yields(20.0, 0.0337);
    double sputter_threshold = 20.0, sputter_angle = 9.3;
    ByMaterial enhanced_yield{7.0, {{"SiGe", 6.5}}};
    double enhanced_threshold = 15.0;
    double oxygen_removal_yield = 3.0, polymer_removal_yield = 3.0, removal_threshold = 10.0;
    Ions ions;

    Cf4O2() { sputter_yield.named["SiGe"] = 0.03; }
};

std::vector<Key> cf4_o2_keys(Cf4O2& p) {
    const std::string flux = "1e15 /cm^2/s", energy = "eV";
    std::vector<Key> list = {
        {"etchant_flux", &p.etchant_flux, flux, "fluorine on an open wafer", kNotNegative},
        {"oxygen_flux", &p.oxygen_flux, flux, "oxygen on an open wafer", kNotNegative},
        {"polymer_flux", &p.polymer_flux, flux, "polymer precursor on an open wafer", kNotNegative},
        {"ion_flux", &p.ion_flux, flux, "ions on an open wafer; 0: none are traced, as in a remote plasma",
         kNotNegative},
        {"etched", &p.etched, "",
         "materials that the plasma etches chemically; all others are only sputtered", kMaterial},
        {"germanium", &p.germanium, "",
         "x: germanium's fraction of the atoms; where it is above 0, fluorine removes adsorbed oxygen",
         kProbability},
        {"etchant_sticking", &p.etchant_sticking, "",
         "beta_F: sticking probability of fluorine on free sites", kProbability},
        {"etchant_on_oxygen_sticking", &p.etchant_on_oxygen_sticking, "",
         "beta_FO: sticking probability of fluorine on sites that oxygen holds", kProbability},
        {"oxygen_sticking", &p.oxygen_sticking, "", "beta_O: sticking probability of oxygen on free sites",
         kProbability},
        {"oxygen_on_polymer_sticking", &p.oxygen_on_polymer_sticking, "",
         "beta_OC: sticking probability of oxygen on polymer, which it burns off", kProbability},
        {"polymer_sticking", &p.polymer_sticking, "",
         "beta_C: sticking probability of the polymer precursor on free sites", kProbability},
        {"polymer_on_oxygen_sticking", &p.polymer_on_oxygen_sticking, "",
         "beta_CO: sticking probability of the polymer precursor on sites that oxygen holds, where it "
         "forms no polymer",
         kProbability},
        {"coverage_beta", &p.coverage_beta, "",
         "true: the coverage equations count only arrivals that stick, as is right; false: all arrivals"},
        coverage_tolerance_key(p.coverage_tolerance),
        {"k_sigma", &p.k_sigma, flux,
         "thermal desorption rate of the etched silicon; multiplied by exp(0.4675 x) at a germanium "
         "fraction of x",
         kNotNegative},
        {"beta_sigma", &p.beta_sigma, flux, "desorption rate of oxygen", kNotNegative},
        {"sputter_yield", &p.sputter_yield, "",
         "A_sp: sputter yield factor, for every material on the wafer; those with a published value need "
         "not be named",
         kNotNegative},
        sputter_threshold_key(p.sputter_threshold),
        sputter_angle_key(p.sputter_angle),
        {"enhanced_yield", &p.enhanced_yield, "",
         "A_ie: yield factor of ion-enhanced etching, for the etched materials", kNotNegative},
        enhanced_threshold_key(p.enhanced_threshold),
        {"oxygen_removal_yield", &p.oxygen_removal_yield, "", "A_O: yield factor of oxygen removal by ions",
         kNotNegative},
        {"polymer_removal_yield", &p.polymer_removal_yield, "",
         "A_C: yield factor of polymer removal by ions", kNotNegative},
        {"removal_threshold", &p.removal_threshold, energy,
         "E_p: ion energy below which ions remove neither oxygen nor polymer", kNotNegative},
    };
    append_keys(list, ion_keys(p.ions));
    return list;
}

// Sticking probabilities by neutral and material.
struct Sticking {
    std::array<std::vector<double>, 3> free;   // on free sites
    std::array<std::vector<double>, 3> taken;  // F and C on oxygen's sites, O on the polymer's
};

double sticking_at(const Sticking& s, std::size_t k, std::size_t m, std::span<const double> theta) {
    const double sites = std::max(0.0, 1.0 - theta[kF] - theta[kO] - theta[kC]);
    return std::clamp(s.free[k][m] * sites + s.taken[k][m] * (k == kO ? theta[kC] : theta[kO]), 0.0, 1.0);
}

// Ions, fluorine, oxygen and a polymer precursor on silicon and silicon-germanium. The sites are those of
// Belen et al., JVST A 23, 99 (2005), with the polymer as a third adsorbate, which oxygen burns. Fluorine
// removes oxygen from germanium, whose oxyfluoride does not block the etch as silicon's does (Campo et al.,
// JVST B 13, 235 (1995)). Equations and defaults are those of ViennaPS 4.6 (psCF4O2Etching.hpp), which cites
// no measurement. Two equations differ: there k_sigma depends on the oxygen as well, and sputtering not on
// the angle. Fluxes in 1e15 /cm^2/s.
Model make_cf4_o2(const Cf4O2& p, const Materials& materials) {
    // Tallies in the order of flux_names: the neutrals, then the ion's arrivals and yields if there are ions.
    enum Tally : std::size_t {
        kEtchant,
        kOxygen,
        kPolymer,
        kIon,
        kSputter,
        kEnhanced,
        kOxygenRemoval,
        kPolymerRemoval
    };
    const auto by_material = [&](const ByMaterial& value) { return by_material_id(value, materials); };
    const std::array<double, 3> gas{p.etchant_flux, p.oxygen_flux, p.polymer_flux};
    const double ions = p.ion_flux;
    const Sticking sticking{
        {by_material(p.etchant_sticking), by_material(p.oxygen_sticking), by_material(p.polymer_sticking)},
        {by_material(p.etchant_on_oxygen_sticking), by_material(p.oxygen_on_polymer_sticking),
         by_material(p.polymer_on_oxygen_sticking)}};
    const std::vector<double> rho = densities(materials), germanium = by_material(p.germanium);
    std::vector<double> k_sigma(materials.size(), p.k_sigma);
    for (std::size_t m = 0; m < k_sigma.size(); ++m) k_sigma[m] *= std::exp(kGermaniumBoost * germanium[m]);
    const std::vector<std::uint8_t> reacts = marked(p.etched, materials);

    Model model;
    model.species = {{"etchant", 1.0, sticking.free[kF]},
                     {"oxygen", 1.0, sticking.free[kO]},
                     {"polymer", 1.0, sticking.free[kC]}};
    if (ions > 0.0) {
        model.species.push_back(ion_species(
            p.ions,
            {{"sputter",
              flux::Angular::sputter,
              p.sputter_threshold,
              by_material(p.sputter_yield),
              {p.sputter_angle}},
             {"enhanced", flux::Angular::enhanced, p.enhanced_threshold, by_material(p.enhanced_yield), {}},
             {"oxygen_removal", flux::Angular::enhanced, p.removal_threshold, {p.oxygen_removal_yield}, {}},
             {"polymer_removal",
              flux::Angular::enhanced,
              p.removal_threshold,
              {p.polymer_removal_yield},
              {}}}));
    }
    const auto by_ions = [ions](const SurfacePoint& point, Tally tally) {
        return ions > 0.0 ? ions * point.flux[tally] : 0.0;
    };

    model.coverages.names = {"etchant", "oxygen", "polymer"};
    model.coverages.tolerance = p.coverage_tolerance;
    model.coverages.react = [=, beta_in_coverage = p.coverage_beta, beta_sigma = p.beta_sigma](
                                const SurfacePoint& point, double, std::span<double> theta) {
        const auto m = static_cast<std::size_t>(point.material);
        const auto gain = [&](const std::array<std::vector<double>, 3>& beta, Neutral k) {
            return (beta_in_coverage ? beta[k][m] : 1.0) * gas[k] * point.flux[k];
        };
        const double by_etchant = germanium[m] > 0.0 ? gain(sticking.taken, kF) : 0.0;
        const auto steady = competing_coverages<3>(
            {{{gain(sticking.free, kF), k_sigma[m] + 2.0 * by_ions(point, kEnhanced)},
              {gain(sticking.free, kO), beta_sigma + by_ions(point, kOxygenRemoval) + by_etchant},
              {gain(sticking.free, kC), by_ions(point, kPolymerRemoval) + gain(sticking.taken, kO)}}});
        std::ranges::copy(steady, theta.begin());
    };
    model.sticking = [=](std::size_t k, const SurfacePoint& point) {
        return k < 3 ? sticking_at(sticking, k, static_cast<std::size_t>(point.material), point.coverage)
                     : 0.0;
    };
    model.in_nm_per_s = true;
    model.speed = [=](const SurfacePoint& point) {
        const auto m = static_cast<std::size_t>(point.material);
        double rate = by_ions(point, kSputter);
        if (reacts[m]) rate += point.coverage[kF] * (0.25 * k_sigma[m] + by_ions(point, kEnhanced));
        return -rate / rho[m];
    };
    return model;
}

}  // namespace

ModelEntry cf4_o2() {
    return model_entry(
        "cf4_o2",
        "CF4/O2 plasma on silicon and silicon-germanium: V = -(k_sigma theta_F/4 + Y_sp Gamma_i + theta_F Y_ie "
        "Gamma_i)/rho",
        cf4_o2_keys, make_cf4_o2);
}

}  // namespace sidewall::app
