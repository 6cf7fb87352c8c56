#include <algorithm>
#include <cmath>

#include "app/models/chemistry.hpp"
#include "app/models/ions.hpp"

namespace sidewall::app {
namespace {

// Species, in that order; and coverages, one for each neutral.
enum Neutral : std::size_t { kF, kO, kC };

constexpr double kGermaniumBoost = 0.4675;  // k_sigma(x) = k_sigma exp(0.4675 x)

// What decides the sites of a material, in the order of the neutrals.
struct Sticking {
    std::array<std::vector<double>, 3> free;   // on free sites
    std::array<std::vector<double>, 3> taken;  // etchant and polymer on oxygen's, oxygen on the polymer's
};

double sticking_at(const Sticking& s, std::size_t k, std::size_t m, std::span<const double> theta) {
    const double sites = std::max(0.0, 1.0 - theta[kF] - theta[kO] - theta[kC]);
    return std::clamp(s.free[k][m] * sites + s.taken[k][m] * (k == kO ? theta[kC] : theta[kO]), 0.0, 1.0);
}

// Ions, fluorine, oxygen and a polymer precursor on silicon and its alloys with germanium: the sites of Belen
// et al., JVST A 23, 99 (2005), with the polymer as a third adsorbate, oxygen burning it, and fluorine taking
// oxygen off germanium, whose oxyfluoride does not hold the etch up as silicon's does (Campo et al., JVST B
// 13, 235 (1995)). Equations and defaults are those of ViennaPS 4.6 (psCF4O2Etching.hpp), which names no
// measurement, but for two: k_sigma there depends on the oxygen as well, and its sputtering not on the angle.
// Fluxes in 1e15 /cm^2/s.
Model make_cf4_o2(const Values& values, const Materials& materials) {
    // Tallies: the neutrals, then the ion's arrivals and yields, if there are ions.
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
    const auto number = [&](const char* key) { return values.get<double>(key); };
    const auto by_material = [&](const char* key) {
        return by_material_id(values.get<ByMaterial>(key), materials);
    };
    const std::array<double, 3> gas{number("etchant_flux"), number("oxygen_flux"), number("polymer_flux")};
    const double ions = number("ion_flux"), beta_sigma = number("beta_sigma");
    const Sticking sticking{
        {by_material("etchant_sticking"), by_material("oxygen_sticking"), by_material("polymer_sticking")},
        {by_material("etchant_on_oxygen_sticking"), by_material("oxygen_on_polymer_sticking"),
         by_material("polymer_on_oxygen_sticking")}};
    const std::vector<double> rho = densities(materials), germanium = by_material("germanium");
    std::vector<double> k_sigma(materials.size(), number("k_sigma"));
    for (std::size_t m = 0; m < k_sigma.size(); ++m) k_sigma[m] *= std::exp(kGermaniumBoost * germanium[m]);
    const bool beta_in_coverage = values.get<bool>("coverage_beta");
    std::vector<std::uint8_t> reacts(materials.size(), 0);
    for (const std::string& name : values.get<std::vector<std::string>>("etched"))
        reacts[static_cast<std::size_t>(*material_id(materials, name))] = 1;

    Model model;
    model.species = {{"etchant", 1.0, sticking.free[kF]},
                     {"oxygen", 1.0, sticking.free[kO]},
                     {"polymer", 1.0, sticking.free[kC]}};
    if (ions > 0.0) {
        const double e_sp = number("sputter_threshold"), e_ie = number("enhanced_threshold"),
                     e_p = number("removal_threshold");
        flux::Species ion = ion_species(values, std::min({e_sp, e_ie, e_p}));
        ion.yields = {
            {"sputter",
             flux::Angular::sputter,
             e_sp,
             by_material("sputter_yield"),
             {number("sputter_angle")}},
            {"enhanced", flux::Angular::enhanced, e_ie, by_material("enhanced_yield"), {}},
            {"oxygen_removal", flux::Angular::enhanced, e_p, {number("oxygen_removal_yield")}, {}},
            {"polymer_removal", flux::Angular::enhanced, e_p, {number("polymer_removal_yield")}, {}}};
        model.species.push_back(std::move(ion));
    }
    const auto by_ions = [ions](const SurfacePoint& point, Tally tally) {
        return ions > 0.0 ? ions * point.flux[tally] : 0.0;
    };

    model.coverages.names = {"etchant", "oxygen", "polymer"};
    model.coverages.tolerance = number("coverage_tolerance");
    model.coverages.react = [=](const SurfacePoint& point, double, std::span<double> theta) {
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

std::vector<Key> cf4_o2_keys() {
    const std::string flux = "1e15 /cm^2/s", energy = "eV";
    ByMaterial sputter = sputter_yields(20.0, 0.0337);
    sputter.named["SiGe"] = 0.03;
    std::vector<Key> list = {
        {"etchant_flux", 1800.0, flux, "fluorine on an open wafer", kNotNegative},
        {"oxygen_flux", 100.0, flux, "oxygen on an open wafer", kNotNegative},
        {"polymer_flux", 100.0, flux, "polymer precursor on an open wafer", kNotNegative},
        {"ion_flux", 12.0, flux, "ions on an open wafer; 0: none are traced, as in a remote plasma",
         kNotNegative},
        {"etched",
         std::vector<std::string>{"Si", "PolySi", "SiGe", "Ge"},
         "",
         "materials that react; all others only sputter",
         {.material = true}},
        {"germanium", ByMaterial{0.0, {{"SiGe", 0.3}, {"Ge", 1.0}}}, "",
         "x, its part of the atoms; where above 0, fluorine takes oxygen off", kProbability},
        {"etchant_sticking", ByMaterial{0.7}, "", "beta_F on free sites", kProbability},
        {"etchant_on_oxygen_sticking", ByMaterial{0.3}, "", "beta_FO on oxygen's", kProbability},
        {"oxygen_sticking", ByMaterial{1.0}, "", "beta_O on free sites", kProbability},
        {"oxygen_on_polymer_sticking", ByMaterial{0.3}, "", "beta_OC on the polymer's, which it burns",
         kProbability},
        {"polymer_sticking", ByMaterial{1.0}, "", "beta_C on free sites", kProbability},
        {"polymer_on_oxygen_sticking", ByMaterial{0.3}, "", "beta_CO on oxygen's, where it is lost",
         kProbability},
        {"coverage_beta", true, "", "whether these enter the coverages too, as they should"},
        {"coverage_tolerance",
         1e-3,
         "",
         "mean change of a coverage at which the first fluxes are settled",
         {.min = 1e-8, .max = 1.0}},
        {"k_sigma", 300.0, flux, "thermal desorption of etched silicon; times exp(0.4675 x) with germanium",
         kNotNegative},
        {"beta_sigma", 0.04, flux, "desorption of oxygen", kNotNegative},
        {"sputter_yield", std::move(sputter), "",
         "A_sp of every material on the wafer; those with a published value need not be named", kNotNegative},
        {"sputter_threshold", 20.0, energy, "E_sp", kNotNegative},
        {"sputter_angle", 9.3, "", "B_sp", kNotNegative},
        {"enhanced_yield", ByMaterial{7.0, {{"SiGe", 6.5}}}, "", "A_ie of what is etched", kNotNegative},
        {"enhanced_threshold", 15.0, energy, "E_ie", kNotNegative},
        {"oxygen_removal_yield", 3.0, "", "A_O: oxygen an ion removes", kNotNegative},
        {"polymer_removal_yield", 3.0, "", "A_C: polymer an ion removes", kNotNegative},
        {"removal_threshold", 10.0, energy, "E_p of both", kNotNegative},
    };
    for (Key& key : ion_keys()) list.push_back(std::move(key));
    return list;
}

}  // namespace

ModelEntry cf4_o2() {
    return {
        "cf4_o2",
        "CF4/O2 plasma on silicon and silicon-germanium: V = -(k_sigma theta_F/4 + Y_sp Gamma_i + theta_F Y_ie "
        "Gamma_i)/rho",
        cf4_o2_keys(), make_cf4_o2};
}

}  // namespace sidewall::app
