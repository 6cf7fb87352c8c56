#include <algorithm>
#include <cmath>

#include "app/models/chemistry.hpp"
#include "app/models/ions.hpp"

namespace sidewall::app {
namespace {

constexpr double kBoltzmannEv = 8.617333262e-5;  // eV/K

// La Magna and Garozzo, J. Electrochem. Soc. 150, F178 (2003). Fluxes in 1e15 /cm^2/s. The defaults, beta_ep
// = 0.6 and the stickings among them, are those that ViennaPS (psFluorocarbonEtching.hpp) gives for this
// paper.
Model make_fluorocarbon(const Values& values, const Materials& materials) {
    enum Tally : std::size_t { kIon, kSputter, kEnhanced, kRemoval, kEtchant, kPolymer };
    enum Site : std::size_t { kEtchantSite, kPolymerSite, kEtchantOnPolymer };
    const auto number = [&](const char* key) { return values.get<double>(key); };
    const auto by_material = [&](const char* key) {
        return by_material_id(values.get<ByMaterial>(key), materials);
    };
    const double ions = number("ion_flux"), etchant = number("etchant_flux"),
                 polymer = number("polymer_flux");
    const std::vector<double> beta_e = by_material("etchant_sticking"),
                              beta_p = by_material("polymer_sticking"), rho = densities(materials);
    const double beta_ep = number("etchant_on_polymer_sticking"), polymer_loss = number("polymer_loss"),
                 k_ie = number("enhanced_sites"), k_ev = number("evaporation_sites"),
                 evaporation = number("evaporation") * std::exp(-number("activation_energy") /
                                                                (kBoltzmannEv * number("temperature")));
    const double e_sp = number("sputter_threshold"), e_ie = number("enhanced_threshold"),
                 e_p = number("removal_threshold");

    if (values.get<std::string>("deposit").empty())
        throw KeyError("deposit",
                       "missing: this plasma grows a polymer; name it, e.g. deposit = \"Polymer\"");
    Model model;
    model.deposit = film(values, materials, true);
    const auto film_id = *model.deposit;
    flux::Species ion = ion_species(values, std::min({e_sp, e_ie, e_p}));
    ion.yields = {
        {"sputter", flux::Angular::sputter, e_sp, by_material("sputter_yield"), {number("sputter_angle")}},
        {"enhanced", flux::Angular::cosine, e_ie, by_material("enhanced_yield"), {}},
        {"removal", flux::Angular::cosine, e_p, {number("removal_yield")}, {}}};
    model.species = {std::move(ion), {"etchant", 1.0, beta_e}, {"polymer", 1.0, beta_p}};

    model.coverages.names = {"etchant", "polymer", "etchant_on_polymer"};
    model.coverages.tolerance = number("coverage_tolerance");
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
    // Free sites, and for the etchant those of the polymer that hold none.
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

std::vector<Key> fluorocarbon_keys() {
    const std::string flux = "1e15 /cm^2/s", energy = "eV";
    constexpr double kSputterThreshold = 18.0, kSilicon = 0.0337;  // silicon: Belen et al. (2005)
    ByMaterial sputter = sputter_yields(kSputterThreshold, kSilicon);
    sputter.named["Polymer"] = 0.0139;  // the usual film, which grows and goes by its own balance
    std::vector<Key> list = {
        {"ion_flux", 56.0, flux, "ions on an open wafer", kNotNegative},
        {"etchant_flux", 500.0, flux, "etchant on an open wafer", kNotNegative},
        {"polymer_flux", 100.0, flux, "polymer precursor on an open wafer", kNotNegative},
        {"etchant_sticking", ByMaterial{0.9}, "", "beta_e on free sites", kProbability},
        {"polymer_sticking", ByMaterial{0.26}, "", "beta_p", kProbability},
        {"etchant_on_polymer_sticking", 0.6, "", "beta_ep", kProbability},
        {"polymer_loss", 1.0, flux, "delta_p", kPositive},
        {"coverage_tolerance",
         1e-3,
         "",
         "mean change of a coverage at which the first fluxes are settled",
         {.min = 1e-8, .max = 1.0}},
        {"sputter_yield", std::move(sputter), "",
         "A_sp of every material on the wafer but the film; those with a published value need not be named",
         kNotNegative},
        {"sputter_threshold", kSputterThreshold, energy, "E_sp", kNotNegative},
        {"sputter_angle", 9.3, "", "B_sp", kNotNegative},
        {"enhanced_yield",
         ByMaterial{std::nullopt, {{"SiO2", 0.0361}, {"Mask", 0.0361}, {"Polymer", 0.0361}}}, "",
         "A_ie of every material on the wafer but the film; the paper has one for SiO2", kNotNegative},
        {"enhanced_threshold", 4.0, energy, "E_ie", kNotNegative},
        {"enhanced_sites", 2.0, "", "k_ie: sites an ion-enhanced event frees", kNotNegative},
        {"removal_yield", 0.0361, "", "A_p: polymer an ion removes", kNotNegative},
        {"removal_threshold", 4.0, energy, "E_p", kNotNegative},
        {"evaporation", 0.0027895, "", "K of F_ev = K Gamma_e exp(-E_a/kT)", kNotNegative},
        {"activation_energy", 0.168, energy, "E_a", kNotNegative},
        {"evaporation_sites", 2.0, "", "k_ev: sites an evaporated molecule frees", kNotNegative},
        {"temperature", 300.0, "K", "of the wafer", kPositive},
        deposit_key(),
    };
    for (Key& key : ion_keys()) list.push_back(std::move(key));
    return list;
}

}  // namespace

ModelEntry fluorocarbon() {
    return {
        "fluorocarbon",
        "fluorocarbon plasma: etches by ions and etchant where the polymer is thin, deposits it elsewhere",
        fluorocarbon_keys(), make_fluorocarbon};
}

}  // namespace sidewall::app
