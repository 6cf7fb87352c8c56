#include <algorithm>

#include "app/models/chemistry.hpp"
#include "app/models/particles.hpp"

namespace sidewall::app {
namespace {

struct Ald {
    double growth_per_cycle = 0.0, pulse = 0.0, purge = 0.0, precursor_flux = 0.0;
    ByMaterial sticking{1.0};
    double evaporation = 0.0, sites = 1.0;
    std::int64_t parts = 10;
    std::string deposit;
    Gas gas;
};

std::vector<Key> ald_keys(Ald& p) {
    const std::string flux = "1e15 /cm^2/time";
    std::vector<Key> keys = {
        {"growth_per_cycle", &p.growth_per_cycle, "length",
         "film thickness that a cycle adds at full coverage", required(kPositive)},
        {"pulse", &p.pulse, "time", "time in a cycle in which the precursor is dosed", required(kPositive)},
        {"purge", &p.purge, "time", "rest of the cycle's time, the other half-reaction included",
         required(kNotNegative)},
        {"precursor_flux", &p.precursor_flux, flux, "Gamma: flux of the precursor on an open flat wafer",
         required(kPositive)},
        {"sticking", &p.sticking, "", "s: sticking probability on a bare surface", kProbability},
        {"evaporation", &p.evaporation, flux, "Gamma_ev: flux that desorbs from a full layer", kNotNegative},
        {"sites", &p.sites, "1e15 /cm^2", "s_0: adsorption sites per area", kPositive},
        {"parts", &p.parts, "", "flux calculations per pulse, each with the coverage reached by then",
         within(1, 1000)},
        deposit_key(p.deposit)};
    append_keys(keys, gas_keys(p.gas));
    return keys;
}

// Each cycle starts bare: d theta/dt = (Gamma s phi (1 - theta) - Gamma_ev theta)/s_0 over the pulse, phi the
// relative flux; then loss alone over the purge. Growth per cycle: growth_per_cycle theta.
Model make_ald(const Ald& p, const Materials& materials) {
    const double dose = p.precursor_flux, loss = p.evaporation, sites = p.sites, pulse = p.pulse,
                 purge = p.purge, growth = p.growth_per_cycle;
    const std::vector<double> sticking = by_material_id(p.sticking, materials);
    Model model;
    model.species = {{"precursor", 1.0, sticking}};
    add_gas(p.gas, "", model);
    model.deposit = film(p.deposit, materials, true);
    model.coverages.names = {"precursor"};
    model.coverages.pulse = pulse;
    model.coverages.parts = static_cast<int>(p.parts);
    model.coverages.react = [=](const SurfacePoint& point, double time, std::span<double> theta) {
        const double gain = dose * sticking[static_cast<std::size_t>(point.material)] * point.flux[0];
        theta[0] = pulsed_coverage(theta[0], gain, loss, sites, time);
    };
    model.sticking = [=](std::size_t, const SurfacePoint& point) {
        return std::clamp(sticking[static_cast<std::size_t>(point.material)] * (1.0 - point.coverage[0]), 0.0,
                          1.0);
    };
    model.speed = [=](const SurfacePoint& point) {
        return growth * pulsed_coverage(point.coverage[0], 0.0, loss, sites, purge) / (pulse + purge);
    };
    return model;
}

}  // namespace

ModelEntry ald() {
    return model_entry(
        "ald",
        "atomic layer deposition in cycles of pulse and purge: V = growth_per_cycle * theta / (pulse + "
        "purge)",
        ald_keys, make_ald);
}

}  // namespace sidewall::app
