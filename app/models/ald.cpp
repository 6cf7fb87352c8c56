#include <algorithm>

#include "app/models/chemistry.hpp"
#include "app/models/gas_keys.hpp"

namespace sidewall::app {
namespace {

// Every cycle doses a bare surface: d theta/dt = (Gamma s phi (1 - theta) - Gamma_ev theta)/s_0 over the
// pulse, loss alone over the purge; then it grows by growth_per_cycle theta.
Model make_ald(const Values& values, const Materials& materials) {
    const auto number = [&](const char* key) { return values.get<double>(key); };
    const double dose = number("precursor_flux"), loss = number("evaporation"), sites = number("sites"),
                 pulse = number("pulse"), purge = number("purge"), growth = number("growth_per_cycle");
    const std::vector<double> sticking = by_material_id(values.get<ByMaterial>("sticking"), materials);
    Model model;
    model.species = {{"precursor", 1.0, sticking}};
    add_gas(values, "", model);
    model.deposit = film(values, materials, true);
    model.coverages.names = {"precursor"};
    model.coverages.pulse = pulse;
    model.coverages.parts = static_cast<int>(values.get<std::int64_t>("parts"));
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
    const std::string flux = "1e15 /cm^2/time";
    ModelEntry entry{
        "ald",
        "atomic layer deposition, cycle after cycle of pulse and purge: V = growth_per_cycle * theta / cycle",
        {{"growth_per_cycle", 0.0, "length", "at full coverage", required(kPositive)},
         {"pulse", 0.0, "time", "dosing in a cycle", required(kPositive)},
         {"purge", 0.0, "time", "rest of a cycle, the other half-reaction included", required(kNotNegative)},
         {"precursor_flux", 0.0, flux, "Gamma on an open wafer", required(kPositive)},
         {"sticking", ByMaterial{1.0}, "", "s on a bare surface", kProbability},
         {"evaporation", 0.0, flux, "Gamma_ev, what a full layer loses", kNotNegative},
         {"sites", 1.0, "1e15 /cm^2", "s_0", kPositive},
         {"parts",
          std::int64_t{10},
          "",
          "traces a pulse, each with the coverage so far",
          {.min = 1, .max = 1000}},
         deposit_key()},
        make_ald};
    for (Key& key : gas_keys()) entry.keys.push_back(std::move(key));
    return entry;
}

}  // namespace sidewall::app
