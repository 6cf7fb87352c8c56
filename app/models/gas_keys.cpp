#include "app/models/gas_keys.hpp"

#include <cmath>
#include <numbers>

namespace sidewall::app {
namespace {

using Number = std::optional<double>;

constexpr double kBoltzmann = 1.380649e-23;                   // J/K
constexpr double kRoomTemperature = 300.0, kNitrogen = 0.37;  // K, and nm

}  // namespace

std::vector<Key> gas_keys() {
    return {
        {"mean_free_path",
         Number(),
         "length",
         "neutrals: between collisions in the gas, which leave every direction as likely; none: they fly straight, or "
         "pressure tells",
         {.min = 0.0, .above_min = true, .word = "none"}},
        {"pressure",
         Number(),
         "Pa",
         "neutrals: of the gas, in place of mean_free_path: k T / (sqrt(2) pi d^2 p); none: no collisions",
         {.min = 0.0, .max = 1e7, .above_min = true, .word = "none"}},
        {"temperature",
         Number(),
         "K",
         "T of that gas; auto: 300",
         {.min = 0.0, .max = 1e4, .above_min = true, .word = "auto"}},
        {"molecule_diameter",
         Number(),
         "nm",
         "d of its molecules; auto: 0.37, nitrogen's",
         {.min = 0.01, .max = 10.0, .word = "auto"}},
    };
}

double kinetic_free_path(double temperature, double diameter, double pressure) {
    return kBoltzmann * temperature /
           (std::numbers::sqrt2 * std::numbers::pi * diameter * diameter * pressure);
}

void add_gas(const Values& values, const std::string& path, Model& model) {
    const auto number = [&](const char* key) { return values.get<Number>(key); };
    flux::Species& species = model.species.back();
    if (species.reflection.kind != flux::Reemission::diffuse)
        for (const char* key : {"mean_free_path", "pressure", "temperature", "molecule_diameter"})
            if (number(key))
                throw KeyError(
                    path + key,
                    "is for neutrals, which a collision leaves thermal; ions keep much of their direction: drop it, "
                    "and widen their source by source_exponent or source_file");
    if (const Number mean = number("mean_free_path")) {
        for (const char* key : {"pressure", "temperature", "molecule_diameter"})
            if (number(key)) throw KeyError(path + key, "comes with mean_free_path; drop one of the two");
        species.mean_free_path = *mean;
    }
    if (const Number pressure = number("pressure")) {
        model.free_paths.resize(model.species.size(), 0.0);
        model.free_paths.back() =
            kinetic_free_path(number("temperature").value_or(kRoomTemperature),
                              1e-9 * number("molecule_diameter").value_or(kNitrogen), *pressure);
        return;
    }
    for (const char* key : {"temperature", "molecule_diameter"})
        if (number(key)) throw KeyError(path + key, "belongs to pressure; give one, or drop this");
}

}  // namespace sidewall::app
