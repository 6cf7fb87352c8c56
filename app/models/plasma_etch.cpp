#include <algorithm>

#include "app/models/chemistry.hpp"
#include "app/models/ions.hpp"

namespace sidewall::app {
namespace {

// Tallies, in the order of flux::tally_names: the ion's arrivals and yields, then the neutrals.
// Ion, etchant and passivant: Belen et al., JVST A 23, 99 (2005). Fluxes in 1e15 /cm^2/s.
Model make_plasma_etch(const Values& values, const Materials& materials) {
    enum Tally : std::size_t { kIon, kSputter, kEnhanced, kRemoval, kEtchant, kPassivant };
    // Coverages.
    enum Site : std::size_t { kEtchantSite, kPassivantSite };
    const auto number = [&](const char* key) { return values.get<double>(key); };
    const auto by_material = [&](const char* key) {
        return by_material_id(values.get<ByMaterial>(key), materials);
    };
    const double ions = number("ion_flux"), etchant = number("etchant_flux"),
                 passivant = number("oxygen_flux"), k_sigma = number("k_sigma"),
                 beta_sigma = number("beta_sigma");
    const std::vector<double> beta_e = by_material("etchant_sticking"),
                              beta_p = by_material("oxygen_sticking"), rho = densities(materials);
    const bool beta_in_coverage = values.get<bool>("coverage_beta");
    std::vector<std::uint8_t> reacts(materials.size(), 0);
    for (const std::string& name : values.get<std::vector<std::string>>("etched"))
        reacts[static_cast<std::size_t>(*material_id(materials, name))] = 1;

    const double e_sp = number("sputter_threshold"), e_ie = number("enhanced_threshold"),
                 e_p = number("removal_threshold");
    Model model;
    flux::Species ion = ion_species(values, std::min({e_sp, e_ie, e_p}));
    ion.yields = {
        {"sputter", flux::Angular::sputter, e_sp, by_material("sputter_yield"), {number("sputter_angle")}},
        {"enhanced", flux::Angular::enhanced, e_ie, {number("enhanced_yield")}, {}},
        {"removal", flux::Angular::enhanced, e_p, {number("removal_yield")}, {}}};
    model.species = {std::move(ion), {"etchant", 1.0, beta_e}, {"oxygen", 1.0, beta_p}};

    model.coverages.names = {"etchant", "oxygen"};
    model.coverages.tolerance = number("coverage_tolerance");
    model.coverages.react = [=](const SurfacePoint& point, double, std::span<double> theta) {
        const auto m = static_cast<std::size_t>(point.material);
        const double to_e = beta_in_coverage ? beta_e[m] : 1.0, to_p = beta_in_coverage ? beta_p[m] : 1.0;
        const PassivatedCoverage steady = passivated_coverage(
            to_e * etchant * point.flux[kEtchant], k_sigma + 2.0 * ions * point.flux[kEnhanced],
            to_p * passivant * point.flux[kPassivant], beta_sigma + ions * point.flux[kRemoval]);
        theta[kEtchantSite] = steady.etchant;
        theta[kPassivantSite] = steady.passivant;
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
        double rate = ions * point.flux[kSputter];
        if (reacts[m]) {
            const double theta = point.coverage[kEtchantSite];
            rate += theta * (0.25 * k_sigma + ions * point.flux[kEnhanced]);
        }
        return -rate / rho[m];
    };
    return model;
}

struct Chemistry {
    double etchant_sticking, sputter_threshold, sputter_yield, enhanced_yield;
};

std::vector<Key> plasma_etch_keys(const Chemistry& c) {
    const std::string flux = "1e15 /cm^2/s", energy = "eV";
    std::vector<Key> list = {
        {"ion_flux", 10.0, flux, "ions on an open wafer", kNotNegative},
        {"etchant_flux", 4500.0, flux, "etchant on an open wafer", kNotNegative},
        {"oxygen_flux", 800.0, flux, "passivant on an open wafer", kNotNegative},
        {"etched",
         std::vector<std::string>{"Si", "PolySi"},
         "",
         "materials that react; all others only sputter",
         {.material = true}},
        {"etchant_sticking", ByMaterial{c.etchant_sticking}, "", "beta_E on free sites", kProbability},
        {"oxygen_sticking", ByMaterial{1.0}, "", "beta_P on free sites", kProbability},
        {"coverage_beta", true, "", "whether beta enters the coverages too, as it should"},
        {"coverage_tolerance",
         1e-3,
         "",
         "mean change of a coverage at which the first fluxes are settled",
         {.min = 1e-8, .max = 1.0}},
        {"k_sigma", 300.0, flux, "thermal desorption of etched material", kNotNegative},
        {"beta_sigma", 0.04, flux, "desorption of the passivant", kNotNegative},
        {"sputter_yield", sputter_yields(c.sputter_threshold, c.sputter_yield), "",
         "A_sp of every material on the wafer; those with a published value need not be named", kNotNegative},
        {"sputter_threshold", c.sputter_threshold, energy, "E_sp", kNotNegative},
        {"sputter_angle", 9.3, "", "B_sp", kNotNegative},
        {"enhanced_yield", c.enhanced_yield, "", "A_ie", kNotNegative},
        {"enhanced_threshold", 15.0, energy, "E_ie", kNotNegative},
        {"removal_yield", 3.0, "", "A_p: passivant an ion removes", kNotNegative},
        {"removal_threshold", 10.0, energy, "E_p", kNotNegative},
    };
    for (Key& key : ion_keys()) list.push_back(std::move(key));
    return list;
}

}  // namespace

ModelEntry sf6_o2() {
    return {"sf6_o2",
            "SF6/O2 plasma on silicon: V = -(k_sigma theta_E/4 + Y_sp Gamma_i + theta_E Y_ie Gamma_i)/rho",
            plasma_etch_keys({0.7, 20.0, 0.0337, 7.0}), make_plasma_etch};
}

ModelEntry hbr_o2() {
    return {"hbr_o2", "HBr/O2 plasma on silicon: the equations of sf6_o2 with other numbers",
            plasma_etch_keys({0.1, 30.0, 0.5, 5.0}), make_plasma_etch};
}

}  // namespace sidewall::app
