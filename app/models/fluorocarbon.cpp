#include <algorithm>
#include <cmath>

#include "app/models/chemistry.hpp"
#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

constexpr double kBoltzmannEv = 8.617333262e-5;  // eV/K

struct Fluorocarbon {
    double ion_flux = 56.0, etchant_flux = 500.0, polymer_flux = 100.0;
    ByMaterial etchant_sticking{0.9}, polymer_sticking{0.26};
    double etchant_on_polymer_sticking = 0.6, polymer_loss = 1.0, coverage_tolerance = 1e-3;
    ByMaterial sputter_yield = sputter_yields(18.0, 0.0337);  // silicon: Belen et al. (2005)
    double sputter_threshold = 18.0, sputter_angle = 9.3;
    ByMaterial enhanced_yield{std::nullopt, {{"SiO2", 0.0361}, {"Mask", 0.0361}, {"Polymer", 0.0361}}};
    double enhanced_threshold = 4.0, enhanced_sites = 2.0;
    double removal_yield = 0.1444, removal_threshold = 4.0;  // Rodrigues et al. (2023), table 1
    double evaporation = 0.0027895, activation_energy = 0.168, evaporation_sites = 2.0, temperature = 300.0;
    std::string deposit;
    Ions ions;

    // For polymer that is not the step's film: SiO2's yield. The film itself follows the polymer balance.
    Fluorocarbon() { sputter_yield.named["Polymer"] = 0.0139; }
};

std::vector<Key> fluorocarbon_keys(Fluorocarbon& p) {
    const std::string flux = "1e15 /cm^2/s", energy = "eV";
    std::vector<Key> list = {
        {"ion_flux", &p.ion_flux, flux, "ions on an open wafer", kNotNegative},
        {"etchant_flux", &p.etchant_flux, flux, "etchant on an open wafer", kNotNegative},
        {"polymer_flux", &p.polymer_flux, flux, "polymer precursor on an open wafer", kNotNegative},
        {"etchant_sticking", &p.etchant_sticking, "",
         "beta_e: sticking probability of the etchant on free sites", kProbability},
        {"polymer_sticking", &p.polymer_sticking, "", "beta_p: sticking probability of the polymer precursor",
         kProbability},
        {"etchant_on_polymer_sticking", &p.etchant_on_polymer_sticking, "",
         "beta_ep: sticking probability of the etchant on polymer", kProbability},
        {"polymer_loss", &p.polymer_loss, flux, "delta_p: loss rate of the polymer without ions", kPositive},
        coverage_tolerance_key(p.coverage_tolerance),
        {"sputter_yield", &p.sputter_yield, "",
         "A_sp: sputter yield factor, for every material on the wafer but the film; those with a published "
         "value need not be named",
         kNotNegative},
        sputter_threshold_key(p.sputter_threshold),
        sputter_angle_key(p.sputter_angle),
        {"enhanced_yield", &p.enhanced_yield, "",
         "A_ie: yield factor of ion-enhanced etching, for every material on the wafer but the film; "
         "published for SiO2 only",
         kNotNegative},
        enhanced_threshold_key(p.enhanced_threshold),
        {"enhanced_sites", &p.enhanced_sites, "", "k_ie: sites an ion-enhanced event frees", kNotNegative},
        {"removal_yield", &p.removal_yield, "", "A_p: yield factor of polymer removal by ions", kNotNegative},
        {"removal_threshold", &p.removal_threshold, energy,
         "E_p: ion energy below which ions remove no polymer", kNotNegative},
        {"evaporation", &p.evaporation, "",
         "K: factor of the evaporation rate F_ev = K Gamma_e exp(-E_a/kT), Gamma_e being the etchant's flux",
         kNotNegative},
        {"activation_energy", &p.activation_energy, energy, "E_a: activation energy of the evaporation",
         kNotNegative},
        {"evaporation_sites", &p.evaporation_sites, "", "k_ev: sites an evaporated molecule frees",
         kNotNegative},
        {"temperature", &p.temperature, "K", "T: temperature of the wafer", kPositive},
        deposit_key(p.deposit),
    };
    append_keys(list, ion_keys(p.ions));
    return list;
}

// La Magna and Garozzo, J. Electrochem. Soc. 150, F178 (2003). Fluxes in 1e15 /cm^2/s. The defaults, beta_ep
// = 0.6 and the stickings included, are those of ViennaPS (psFluorocarbonEtching.hpp) for this paper, except
// A_p: with its value of 0.0361 polymer buries a flat oxide wafer at 100 eV.
Model make_fluorocarbon(const Fluorocarbon& p, const Materials& materials) {
    enum Tally : std::size_t { kIon, kSputter, kEnhanced, kRemoval, kEtchant, kPolymer };
    enum Site : std::size_t { kEtchantSite, kPolymerSite, kEtchantOnPolymer };
    const double ions = p.ion_flux, etchant = p.etchant_flux, polymer = p.polymer_flux;
    const std::vector<double> beta_e = by_material_id(p.etchant_sticking, materials),
                              beta_p = by_material_id(p.polymer_sticking, materials),
                              rho = densities(materials);
    const double beta_ep = p.etchant_on_polymer_sticking, polymer_loss = p.polymer_loss,
                 k_ie = p.enhanced_sites, k_ev = p.evaporation_sites,
                 evaporation =
                     p.evaporation * std::exp(-p.activation_energy / (kBoltzmannEv * p.temperature));

    if (p.deposit.empty())
        throw KeyError("deposit",
                       "missing: this plasma grows a polymer; name it, e.g. deposit = \"Polymer\"");
    Model model;
    model.deposit = film(p.deposit, materials, true);
    const auto film_id = *model.deposit;
    flux::Species ion =
        ion_species(p.ions, {{"sputter",
                              flux::Angular::sputter,
                              p.sputter_threshold,
                              by_material_id(p.sputter_yield, materials),
                              {p.sputter_angle}},
                             {"enhanced",
                              flux::Angular::cosine,
                              p.enhanced_threshold,
                              by_material_id(p.enhanced_yield, materials),
                              {}},
                             {"removal", flux::Angular::cosine, p.removal_threshold, {p.removal_yield}, {}}});
    model.species = {std::move(ion), {"etchant", 1.0, beta_e}, {"polymer", 1.0, beta_p}};

    model.coverages.names = {"etchant", "polymer", "etchant_on_polymer"};
    model.coverages.tolerance = p.coverage_tolerance;
    model.coverages.react = [=](const SurfacePoint& point, double, std::span<double> theta) {
        const auto m = static_cast<std::size_t>(point.material);
        const double arriving = etchant * point.flux[kEtchant];
        const FluorocarbonCoverage steady =
            fluorocarbon_coverage({.etchant = arriving * beta_e[m],
                                   .etchant_on_polymer = arriving * beta_ep,
                                   .polymer = polymer * point.flux[kPolymer] * beta_p[m],
                                   .polymer_removal = ions * point.flux[kRemoval],
                                   .polymer_loss = polymer_loss,
                                   .enhanced = k_ie * ions * point.flux[kEnhanced],
                                   .evaporation = k_ev * evaporation * arriving});
        theta[kEtchantSite] = steady.etchant;
        theta[kPolymerSite] = steady.polymer;
        theta[kEtchantOnPolymer] = steady.etchant_on_polymer;
    };
    // Both neutrals stick on free sites and on the polymer's sites without etchant (the etchant by beta_ep).
    model.sticking = [=](std::size_t k, const SurfacePoint& point) {
        const auto m = static_cast<std::size_t>(point.material);
        const double e = point.coverage[kEtchantSite], p = point.coverage[kPolymerSite],
                     ep = point.coverage[kEtchantOnPolymer];
        if (k == 0) return 0.0;
        if (k == 1)
            return std::clamp(beta_e[m] * std::max(0.0, 1.0 - e - p) + beta_ep * p * (1.0 - ep), 0.0, 1.0);
        return std::clamp(beta_p[m] * (1.0 - e - p * ep), 0.0, 1.0);
    };
    model.in_nm_per_s = true;
    model.speed = [=](const SurfacePoint& point) {
        const auto m = static_cast<std::size_t>(point.material);
        const double theta = point.coverage[kEtchantSite];
        const double polymer_balance = (polymer * point.flux[kPolymer] * beta_p[m] -
                                        ions * point.flux[kRemoval] * point.coverage[kEtchantOnPolymer]) /
                                       rho[static_cast<std::size_t>(film_id)];
        if (point.coverage[kPolymerSite] >= 1.0) return std::max(0.0, polymer_balance);
        if (point.material == film_id) return std::min(0.0, polymer_balance);
        return -(theta * (evaporation * etchant * point.flux[kEtchant] + ions * point.flux[kEnhanced]) +
                 (1.0 - theta) * ions * point.flux[kSputter]) /
               rho[m];
    };
    return model;
}

}  // namespace

ModelEntry fluorocarbon() {
    return model_entry(
        "fluorocarbon",
        "fluorocarbon plasma: deposits polymer where its coverage reaches 1, etches by ions and etchant "
        "elsewhere",
        fluorocarbon_keys, make_fluorocarbon);
}

}  // namespace sidewall::app
