#include "app/models/gas_keys.hpp"

#include <cmath>
#include <numbers>

namespace sidewall::app {
namespace {

constexpr double kBoltzmann = 1.380649e-23;                   // J/K
constexpr double kRoomTemperature = 300.0, kNitrogen = 0.37;  // K, and nm

}  // namespace

std::vector<Key> gas_keys(Gas& gas) {
    return {
        {"mean_free_path", &gas.mean_free_path, "length",
         "neutrals: between collisions in the gas, which leave every direction as likely; none: they fly straight, or "
         "pressure tells",
         or_word("none", kPositive)},
        {"pressure", &gas.pressure, "Pa",
         "neutrals: of the gas, in place of mean_free_path: k T / (sqrt(2) pi d^2 p); none: no collisions",
         or_word("none", positive_to(1e7))},
        {"temperature", &gas.temperature, "K", "T of that gas; auto: 300", or_word("auto", positive_to(1e4))},
        {"molecule_diameter", &gas.molecule_diameter, "nm", "d of its molecules; auto: 0.37, nitrogen's",
         or_word("auto", within(0.01, 10.0))},
    };
}

double kinetic_free_path(double temperature, double diameter, double pressure) {
    return kBoltzmann * temperature /
           (std::numbers::sqrt2 * std::numbers::pi * diameter * diameter * pressure);
}

void add_gas(Gas gas, const std::string& path, Model& model) {
    // Throws for the first key that is given, from the \p first one on.
    const auto refuse_from = [&](std::size_t first, const char* rule) {
        const std::vector<Key> keys = gas_keys(gas);
        for (std::size_t k = first; k < keys.size(); ++k)
            if (*std::get<std::optional<double>*>(keys[k].target)) throw KeyError(path + keys[k].name, rule);
    };
    flux::Species& species = model.species.back();
    if (species.reflection.kind != flux::Reemission::diffuse)
        refuse_from(
            0,
            "is for neutrals, which a collision leaves thermal; ions keep much of their direction: drop it, "
            "and widen their source by source_exponent or source_file");
    if (gas.mean_free_path) {
        refuse_from(1, "comes with mean_free_path; drop one of the two");
        species.mean_free_path = *gas.mean_free_path;
    }
    if (gas.pressure) {
        model.free_paths.resize(model.species.size(), 0.0);
        model.free_paths.back() =
            kinetic_free_path(gas.temperature.value_or(kRoomTemperature),
                              1e-9 * gas.molecule_diameter.value_or(kNitrogen), *gas.pressure);
        return;
    }
    refuse_from(2, "belongs to pressure; give one, or drop this");
}

}  // namespace sidewall::app
