#include <algorithm>

#include "app/models/chemistry.hpp"
#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

struct PlasmaEtch {
    double ion_flux = 10.0, etchant_flux = 4500.0, oxygen_flux = 800.0;
    std::vector<std::string> etched{"Si", "PolySi"};
    ByMaterial etchant_sticking{}, oxygen_sticking{1.0};
    bool coverage_beta = true;
    double coverage_tolerance = 1e-3, k_sigma = 300.0, beta_sigma = 0.04;
    ByMaterial sputter_yield{};
    double sputter_threshold = 0.0, sputter_angle = 9.3;
    double enhanced_yield = 0.0, enhanced_threshold = 15.0;
    double removal_yield = 3.0, removal_threshold = 10.0;
    Ions ions{};
};

std::vector<Key> plasma_etch_keys(PlasmaEtch& p) {
    const std::string flux = "1e15 /cm^2/s", energy = "eV";
    std::vector<Key> keys = {
        {"ion_flux", &p.ion_flux, flux, "ions on an open wafer", kNotNegative},
        {"etchant_flux", &p.etchant_flux, flux, "etchant on an open wafer", kNotNegative},
        {"oxygen_flux", &p.oxygen_flux, flux, "oxygen, the passivant, on an open wafer", kNotNegative},
        {"etched", &p.etched, "",
         "materials that the plasma etches chemically; all others are only sputtered", kMaterial},
        {"etchant_sticking", &p.etchant_sticking, "",
         "beta_E: sticking probability of the etchant on free sites", kProbability},
        {"oxygen_sticking", &p.oxygen_sticking, "",
         "beta_P: sticking probability of the passivant on free sites", kProbability},
        {"coverage_beta", &p.coverage_beta, "",
         "true: the coverage equations count only arrivals that stick, as is right; false: all arrivals"},
        coverage_tolerance_key(p.coverage_tolerance),
        {"k_sigma", &p.k_sigma, flux, "thermal desorption rate of the etched material", kNotNegative},
        {"beta_sigma", &p.beta_sigma, flux, "desorption rate of the passivant", kNotNegative},
        {"sputter_yield", &p.sputter_yield, "",
         "A_sp: sputter yield factor, for every material on the wafer; those with a published value need "
         "not be named",
         kNotNegative},
        sputter_threshold_key(p.sputter_threshold),
        sputter_angle_key(p.sputter_angle),
        {"enhanced_yield", &p.enhanced_yield, "", "A_ie: yield factor of ion-enhanced etching", kNotNegative},
        enhanced_threshold_key(p.enhanced_threshold),
        {"removal_yield", &p.removal_yield, "", "A_p: yield factor of passivant removal by ions",
         kNotNegative},
        {"removal_threshold", &p.removal_threshold, energy,
         "E_p: ion energy below which ions remove no passivant", kNotNegative},
    };
    append_keys(keys, ion_keys(p.ions));
    return keys;
}

// SF6/O2 and HBr/O2: ion, etchant, passivant (Belen et al., JVST A 23, 99 (2005)). Fluxes in 1e15 /cm^2/s.
Model make_plasma_etch(const PlasmaEtch& p, const Materials& materials) {
    // Tallies in the order of flux_names: the ion's arrivals and yields, then the neutrals.
    enum Tally : std::size_t { kIon, kSputter, kEnhanced, kRemoval, kEtchant, kPassivant };
    enum Site : std::size_t { kEtchantSite, kPassivantSite };
    const std::vector<double> beta_e = by_material_id(p.etchant_sticking, materials),
                              beta_p = by_material_id(p.oxygen_sticking, materials),
                              rho = densities(materials);
    const std::vector<std::uint8_t> reacts = marked(p.etched, materials);

    Model model;
    flux::Species ion = ion_species(
        p.ions, {{"sputter",
                  flux::Angular::sputter,
                  p.sputter_threshold,
                  by_material_id(p.sputter_yield, materials),
                  {p.sputter_angle}},
                 {"enhanced", flux::Angular::enhanced, p.enhanced_threshold, {p.enhanced_yield}, {}},
                 {"removal", flux::Angular::enhanced, p.removal_threshold, {p.removal_yield}, {}}});
    model.species = {std::move(ion), {"etchant", 1.0, beta_e}, {"oxygen", 1.0, beta_p}};

    model.coverages.names = {"etchant", "oxygen"};
    model.coverages.tolerance = p.coverage_tolerance;
    model.coverages.react = [=](const SurfacePoint& point, double, std::span<double> theta) {
        const auto m = static_cast<std::size_t>(point.material);
        const double to_e = p.coverage_beta ? beta_e[m] : 1.0, to_p = p.coverage_beta ? beta_p[m] : 1.0;
        const auto steady = competing_coverages<2>({{{to_e * p.etchant_flux * point.flux[kEtchant],
                                                      p.k_sigma + 2.0 * p.ion_flux * point.flux[kEnhanced]},
                                                     {to_p * p.oxygen_flux * point.flux[kPassivant],
                                                      p.beta_sigma + p.ion_flux * point.flux[kRemoval]}}});
        std::ranges::copy(steady, theta.begin());
    };
    model.sticking = [=, own = model.species](std::size_t k, const SurfacePoint& point) {
        const std::vector<double>& s = own[k].sticking;
        const double beta = s[s.size() == 1 ? 0 : static_cast<std::size_t>(point.material)];
        const double occupied = point.coverage[kEtchantSite] + point.coverage[kPassivantSite];
        return k == 0 ? beta : std::clamp(beta * (1.0 - occupied), 0.0, 1.0);
    };
    model.in_nm_per_s = true;
    model.speed = [=](const SurfacePoint& point) {
        const auto m = static_cast<std::size_t>(point.material);
        double rate = p.ion_flux * point.flux[kSputter];
        if (reacts[m]) {
            const double theta = point.coverage[kEtchantSite];
            rate += theta * (0.25 * p.k_sigma + p.ion_flux * point.flux[kEnhanced]);
        }
        return -rate / rho[m];
    };
    return model;
}

}  // namespace

ModelEntry sf6_o2() {
    return model_entry(
        "sf6_o2",
        "SF6/O2 plasma on silicon: V = -(k_sigma theta_E/4 + Y_sp Gamma_i + theta_E Y_ie Gamma_i)/rho",
        plasma_etch_keys, make_plasma_etch,
        {.etchant_sticking = {0.7},
         .sputter_yield = sputter_yields(20.0, 0.0337),
         .sputter_threshold = 20.0,
         .enhanced_yield = 7.0});
}

ModelEntry hbr_o2() {
    return model_entry("hbr_o2", "HBr/O2 plasma on silicon: the equations of sf6_o2 with other numbers",
                       plasma_etch_keys, make_plasma_etch,
                       {.etchant_sticking = {0.1},
                        .sputter_yield = sputter_yields(30.0, 0.5),
                        .sputter_threshold = 30.0,
                        .enhanced_yield = 5.0});
}

}  // namespace sidewall::app
